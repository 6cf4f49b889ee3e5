# SPDX-License-Identifier: MIT
"""Fuzzes the MTx decoder with mutated frames: no exception, bounded memory, and only samples within the limits pass.

In: a number of frames and a seed. Out: counts of the reader; a failure ends it by its exception. Owns the frames.
"""

from __future__ import annotations

from collections import Counter

import numpy as np

from echostep.xsens import MTDATA, MTDATA2, PROJECT, MtBatch, MtSample, MtxLimits, MtxReader, OutputFormat, encode_frame
from echostep.xsens.frames import MAX_LENGTH
from echostep.xsens.packets import read_packets
from echostep_app.xsens.requests import project_requests
from echostep_app.xsens.setup import MtxSetup
from echostep_simulation.devices.mtx_formats import pack

BLOCK = 20_000  # frames mutated together
MAX_PENDING = MAX_LENGTH + 6  # bytes of the longest unfinished frame
SETUP_SHARE = 50  # one block in SETUP_SHARE is also fed to the setup and to the packet reader, which are slower
OTHER_OUTPUTS = (OutputFormat(0x0004, 0x0001), OutputFormat(0x0007, 0x0108), OutputFormat(0x4000, 0x0001))
SAMPLE = MtSample(0, (0.5, -0.25, 9.75), (0.125, 0.0, -1.5), (0.5, 0.0, -0.875), (0.5, 0.5, -0.5, 0.5))


def mtdata2(form: int, counter: int) -> bytes:
    """An MTData2 frame with counter, quaternion, accel and gyro in number format `form` (float32, fixed 12.20, fixed 16.32, float64)."""
    number = (
        lambda v: np.array(v, ">f4").tobytes(),
        lambda v: np.array(round(v * 2**20), ">i4").tobytes(),
        lambda v: (round(v * 2**32) & 0xFFFFFFFF).to_bytes(4, "big") + int(np.floor(v)).to_bytes(2, "big", signed=True),
        lambda v: np.array(v, ">f8").tobytes(),
    )[form]
    payload = b"\x10\x20\x02" + counter.to_bytes(2, "big")
    for identifier, values in ((0x2010, SAMPLE.quaternion), (0x4020, SAMPLE.accel), (0x8020, SAMPLE.gyro)):
        content = b"".join(number(v) for v in values)
        payload += (identifier | form).to_bytes(2, "big") + bytes([len(content)]) + content
    return encode_frame(MTDATA2, payload)


def frames(count: int, rng: np.random.Generator) -> list[bytes]:
    """Frames of all kinds with increasing counters, most of them in the output format of this project."""
    kinds = rng.choice(7, size=count, p=[0.6, 0.05, 0.05, 0.1, 0.1, 0.05, 0.05])
    made = []
    for n, kind in enumerate(kinds.tolist()):
        if kind == 0:
            made.append(encode_frame(MTDATA, pack(SAMPLE._replace(counter=n), PROJECT)))
        elif kind == 1:
            made.append(encode_frame(MTDATA, pack(SAMPLE._replace(counter=n), OTHER_OUTPUTS[n % 3])))
        elif kind == 2:
            made.append(encode_frame(n % 256, bytes(n % 400)))  # every message, also with extended length
        else:
            made.append(mtdata2(kind - 3, n & 0xFFFF))
    return made


def mutate(stream: bytes, rng: np.random.Generator, count: int) -> bytes:
    """Change, delete and insert bytes, some to special values of the protocol; some changes keep the checksum, so that the limits are tested."""
    changed = np.frombuffer(stream, np.uint8).copy()
    index = rng.integers(0, len(changed), count)
    changed[index] ^= rng.integers(1, 256, count, dtype=np.uint8)
    index = rng.integers(0, len(changed), count // 4)
    changed[index] = rng.choice(np.array([0xFA, 0xFF, 0x00, 0x7F, 0x80, 0x32, 0x36], np.uint8), len(index))
    index = rng.integers(0, len(changed), count // 4)
    balance = rng.integers(1, 256, len(index), dtype=np.uint8)
    np.add.at(changed, index, balance)  # two changes that cancel in the checksum
    np.subtract.at(changed, np.minimum(index + rng.integers(1, 8, len(index)), len(changed) - 1), balance)
    changed = np.delete(changed, rng.integers(0, len(changed), count // 8))
    index = rng.integers(0, len(changed), count // 8)
    return np.insert(changed, index, rng.integers(0, 256, len(index), dtype=np.uint8)).tobytes()


def check(batch: MtBatch, fed: int, limits: MtxLimits) -> None:
    """Raise AssertionError when a sample is outside the limits."""
    quaternion = batch.quaternion[~np.isnan(batch.quaternion).all(axis=1)]
    mag = batch.mag[~np.isnan(batch.mag).all(axis=1)]
    assert np.all(np.abs(batch.accel) <= limits.accel_m_s2), "accel"
    assert np.all(np.abs(batch.gyro) <= limits.gyro_rad_s), "gyro"
    assert np.all(np.abs(mag) <= limits.mag), "mag"
    assert np.all(np.abs(np.linalg.norm(quaternion, axis=1) - 1.0) <= limits.quaternion_error + 1e-12), "quaternion"
    assert np.all((batch.counter >= 0) & (batch.counter < 1 << 16)), "counter"
    assert np.all(np.diff(batch.counter) != 0), "repeated"
    assert np.all(np.diff(batch.end) >= 0), "order"
    assert not len(batch.end) or 0 < batch.end[0] <= batch.end[-1] <= fed, "end"


def fuzz(count: int, seed: int) -> Counter[str]:
    """Feed `count` mutated frames; returns the reader's counts. Raises what the decoder raises."""
    rng = np.random.default_rng(seed)
    blocks = [b"".join(frames(min(BLOCK, count), rng)) for _ in range(2)]
    limits, reader = MtxLimits(), MtxReader()
    total, fed, passed = 0, 0, 0
    while total < count:
        stream = mutate(blocks[total // BLOCK % 2], rng, min(BLOCK, count) // 2)
        cuts = np.sort(rng.integers(0, len(stream), 40)).tolist()
        for start, end in zip([0, *cuts], [*cuts, len(stream)], strict=True):
            batch = reader.feed_batch(stream[start:end])
            check(batch, end - start, limits)
            passed += len(batch.counter)
            assert reader.pending <= MAX_PENDING, "memory"
        if total // BLOCK % SETUP_SHARE == 0:
            feed_setup(stream[:200_000])
        fed += len(stream)
        total += min(BLOCK, count)
    counts = reader.counts
    assert counts.good == passed, "counts"
    totals = Counter({name: getattr(counts, name) for name in counts.__dataclass_fields__})
    totals["frames"], totals["bytes"] = total, fed
    return totals


def feed_setup(stream: bytes) -> None:
    """Feed the same bytes to the MTx setup, and to the packet reader, which may only raise ValueError."""
    setup = MtxSetup(project_requests(100.0), 100.0)
    for k in range(0, len(stream), 997):
        assert len(setup.advance(stream[k : k + 997], k * 1e-5)) < 1_000, "answers"
        try:
            read_packets(stream[k : k + 60])
        except ValueError:
            continue
