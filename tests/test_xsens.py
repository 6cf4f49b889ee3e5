"""MTx frames and samples: any split, damage, gates, the counter's wrap."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from echostep.xsens import MTDATA, FrameReader, MtSample, MtxReader, encode_frame, pack_mtdata


def sample(counter: int, gyro_x: float = 0.1) -> MtSample:
    return MtSample(counter, (0.5, -0.25, 9.75), (gyro_x, 0.0, -1.5), (0.5, 0.0, -0.875), (1.0, 0.0, 0.0, 0.0))


def frame(counter: int, gyro_x: float = 0.125) -> bytes:
    return encode_frame(MTDATA, pack_mtdata(sample(counter, gyro_x)))


def test_the_frame_is_the_one_of_the_manual() -> None:
    assert encode_frame(0x30, b"") == bytes.fromhex("FAFF3000D1")  # GoToConfig
    assert len(frame(0)) == 59
    assert frame(258)[:4] == bytes.fromhex("FAFF3236")
    assert frame(258)[-3:-1] == b"\x01\x02"


@pytest.mark.parametrize("length", [0, 1, 253, 254, 255, 256, 2048])
def test_lengths_normal_and_extended(length: int) -> None:
    payload = bytes(k % 251 for k in range(length))
    assert FrameReader().feed(encode_frame(0x12, payload)) == [(0x12, payload)]


def test_a_payload_that_is_too_long_is_refused() -> None:
    with pytest.raises(ValueError, match="2049"):
        encode_frame(0x12, bytes(2049))


@given(st.binary(max_size=300), st.lists(st.integers(0, 1500), max_size=8))
def test_any_split_gives_the_same(noise: bytes, cuts: list[int]) -> None:
    stream = b"".join(frame(n) for n in range(8)) + noise + b"".join(frame(n) for n in range(8, 60))
    whole, split = MtxReader(), MtxReader()
    expected = whole.feed(stream)
    edges = sorted({0, len(stream), *(c % len(stream) for c in cuts)})
    found = [s for a, b in zip(edges, edges[1:], strict=False) for s in split.feed(stream[a:b])]
    assert found == expected
    assert split.counts == whole.counts
    assert [s.counter for s in found[:8]] == list(range(8))
    assert found[-1].counter == 59


@given(st.integers(0, 20 * 59 - 1), st.integers(1, 255))
def test_a_flipped_byte_costs_one_frame(at: int, flip: int) -> None:
    stream = bytearray(b"".join(frame(n) for n in range(60)))
    stream[at] ^= flip
    reader = MtxReader()
    found = [s.counter for s in reader.feed(bytes(stream))]
    assert len(set(range(60)) - set(found)) <= 1 or reader.counts.lost
    assert set(range(22, 60)) <= set(found)


@given(st.binary(max_size=5000))
def test_noise_never_raises_and_memory_is_bounded(noise: bytes) -> None:
    reader = FrameReader()
    reader.feed(noise)
    assert len(reader._rest) <= 2048 + 7


@pytest.mark.parametrize(
    ("bad", "reason"),
    [
        (sample(1)._replace(accel=(math.nan, 0.0, 0.0)), "not_finite"),
        (sample(1)._replace(gyro=(math.inf, 0.0, 0.0)), "not_finite"),
        (sample(1)._replace(accel=(300.0, 0.0, 0.0)), "out_of_range"),
        (sample(1)._replace(gyro=(0.0, -30.0, 0.0)), "out_of_range"),
        (sample(1)._replace(quaternion=(0.9, 0.0, 0.0, 0.0)), "bad_quaternion"),
    ],
)
def test_what_cannot_be_is_counted_by_its_reason(bad: MtSample, reason: str) -> None:
    reader = MtxReader()
    assert reader.feed(encode_frame(MTDATA, pack_mtdata(bad))) == []
    assert getattr(reader.counts, reason) == 1


def test_the_counter_wraps_and_gaps_are_counted() -> None:
    reader = MtxReader()
    for counter in (65534, 65535, 0, 1, 5, 5, 6):
        reader.feed(frame(counter))
    assert (reader.counts.good, reader.counts.lost, reader.counts.repeated) == (6, 3, 1)


def test_other_messages_are_counted() -> None:
    reader = MtxReader()
    reader.feed(encode_frame(0x3E, b"") + encode_frame(MTDATA, bytes(10)))
    assert (reader.counts.other_messages, reader.counts.bad_length) == (1, 1)
