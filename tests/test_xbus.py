"""MTx samples many at once: like the reader that takes frame after frame, whatever the split, and known when their last byte is."""

from __future__ import annotations

import random

from hypothesis import given
from hypothesis import strategies as st

from echostep import xbus, xsens

NAN = float("nan")


def sample(counter: int, rng: random.Random) -> xsens.MtSample:
    kind = rng.random()
    w = 2.0 if kind < 0.02 else NAN if kind < 0.04 else 1.0
    force = 500.0 if 0.04 < kind < 0.06 else rng.uniform(-50, 50)
    return xsens.MtSample(
        counter & 0xFFFF, (force, 0.5, 9.75), (0.25, rng.random(), -1.0), (1.0, 0.0, 0.5), (w, 0.0, 0.0, 0.0)
    )


def stream(seed: int) -> bytes:
    """Samples with repetitions, gaps, other messages, wrong lengths and damage."""
    rng = random.Random(seed)
    counter, frames = 65_500, []
    for _ in range(rng.randrange(80)):
        counter += rng.choice([1, 1, 1, 1, 0, 3])
        frames.append(xsens.encode_frame(xsens.MTDATA, xsens.pack_mtdata(sample(counter, rng))))
        if rng.random() < 0.05:
            frames.append(
                xsens.encode_frame(rng.choice([0x3E, xsens.MTDATA]), rng.randbytes(rng.choice([0, 10, 54, 255, 300])))
            )
    octets = bytearray(b"".join(frames))
    for _ in range(rng.randrange(20)):
        if octets:
            octets[rng.randrange(len(octets))] = rng.choice([0xFA, 0xFF, 0x32, rng.randrange(256)])
    return bytes(octets)


def columns(batch: xbus.MtBatch) -> list[xsens.MtSample]:
    rows = zip(*(getattr(batch, name).tolist() for name in xsens.MtSample._fields), strict=True)
    return [xsens.MtSample(c, *(tuple(v) for v in vectors)) for c, *vectors in rows]


@given(st.integers(0, 1 << 32), st.lists(st.integers(0, 5_000), max_size=6))
def test_like_the_reader_that_takes_frame_after_frame(seed: int, cuts: list[int]) -> None:
    octets = stream(seed)
    edges = sorted({0, len(octets), *(min(c, len(octets)) for c in cuts)})
    one, many = xsens.MtxReader(), xbus.MtxReader()
    found = [s for a, b in zip(edges, edges[1:], strict=False) for s in columns(many.feed_batch(octets[a:b]))]
    assert found == one.feed(octets)
    assert many.counts == one.counts


@given(st.integers(0, 1 << 32))
def test_a_sample_is_known_with_the_byte_at_its_end_and_not_before(seed: int) -> None:
    octets = stream(seed)
    whole, reader = xbus.MtxReader().feed_batch(octets), xbus.MtxReader()
    known = [at + 1 for at in range(len(octets)) for _ in reader.feed_batch(octets[at : at + 1]).counter]
    assert whole.end.tolist() == known


@given(st.binary(max_size=4_000))
def test_noise_never_raises_and_memory_is_bounded(noise: bytes) -> None:
    reader = xbus.MtxReader()
    reader.feed_batch(noise)
    assert len(reader._rest) <= xsens.MAX_LENGTH + 7
