# SPDX-License-Identifier: MIT
"""MTx frames and samples: any split, damage, gates, the counter's wrap; MTData2 in every number format and world."""

from __future__ import annotations

import math
import struct
import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from echostep.xsens import (
    MTDATA,
    MTDATA2,
    FrameReader,
    MtBatch,
    MtSample,
    MtxReader,
    OutputFormat,
    axes,
    encode_frame,
    pack_mtdata,
)
from echostep.xsens.frames import LONGEST
from echostep.xsens.mtdata import ACCEL, ATTITUDE, CELSIUS, GYRO, MAG, decode_mtdata
from echostep.xsens.reader import HELD
from echostep_simulation.devices.mtx_formats import pack


def sample(counter: int, gyro_x: float = 0.1) -> MtSample:
    return MtSample(counter, (0.5, -0.25, 9.75), (gyro_x, 0.0, -1.5), (0.5, 0.0, -0.875), (1.0, 0.0, 0.0, 0.0))


def frame(counter: int, gyro_x: float | None = None) -> bytes:
    """No two in a row are equal, unless `gyro_x` is."""
    return encode_frame(MTDATA, pack_mtdata(sample(counter, 0.125 * (counter % 2 + 1) if gyro_x is None else gyro_x)))


def test_the_frame_is_the_one_of_the_manual() -> None:
    assert encode_frame(0x30, b"") == bytes.fromhex("FAFF3000D1")  # GoToConfig
    assert len(frame(0)) == 59
    assert frame(258)[:4] == bytes.fromhex("FAFF3236")
    assert frame(258)[-3:-1] == b"\x01\x02"


@pytest.mark.parametrize("length", [0, 1, 253, 254, 255, 256, 2048])
def test_lengths_normal_and_extended(length: int) -> None:
    payload = bytes(k % 251 for k in range(length))
    assert FrameReader().feed(encode_frame(0x12, payload)) == [(0x12, payload, 0xFF)]


def test_a_payload_that_is_too_long_is_refused() -> None:
    with pytest.raises(ValueError, match="65536"):
        encode_frame(0x12, bytes(65536))


def test_long_frames_are_read_in_captures_and_hold_nothing_back_on_a_port() -> None:
    settings = bytes(k % 251 for k in range(15_000))
    stream = frame(1) + encode_frame(0x12, settings) + frame(2)
    reader = FrameReader(LONGEST)
    assert [f.payload == settings for f in reader.feed(stream)] == [False, True, False]
    assert (reader.counts.skipped_bytes, reader.counts.bad_checksum) == (0, 0)
    live = FrameReader()
    assert len([f for f in live.feed(stream) if f.mid == MTDATA]) >= 2
    assert live.counts.skipped_bytes >= 6


@given(st.integers(0, 20 * 59 - 1), st.integers(1, 255))
def test_a_flipped_byte_costs_one_frame(at: int, flip: int) -> None:
    stream = bytearray(b"".join(frame(n) for n in range(60)))
    stream[at] ^= flip
    reader = MtxReader()
    found = [s.counter for s in reader.feed(bytes(stream))]
    assert len(set(range(60)) - set(found)) <= 1 or reader.counts.lost
    assert set(range(22, 60)) <= set(found)


def other(counter: int, kind: int) -> bytes:
    """A frame of another kind: MTData2, an error, a wake-up, an extended length, a false preamble inside."""
    payload = b"\x10\x20\x02" + counter.to_bytes(2, "big")
    for identifier, values in ((b"\x40\x20", (0.5, -0.25, 9.75)), (b"\x80\x20", (0.125, 0.0, -1.5))):
        payload += identifier + b"\x0c" + struct.pack(">3f", *values)
    kinds = (
        encode_frame(MTDATA2, payload), encode_frame(0x42, b"\x04"), encode_frame(0x3E), encode_frame(0x12, bytes(300)),
        b"\xfa\xff\x32\x90",
    )  # fmt: skip
    return kinds[kind]


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.integers(0, 6), min_size=1, max_size=40),
    st.lists(st.tuples(st.integers(0, 4000), st.integers(1, 255)), max_size=4),
    st.lists(st.integers(0, 4000), max_size=12),
)
def test_batches_do_not_depend_on_the_cuts(kinds: list[int], flips: list[tuple[int, int]], cuts: list[int]) -> None:
    stream = bytearray(b"".join(frame(n) if k > 4 else other(n, k) for n, k in enumerate(kinds)))
    for at, flip in flips:
        stream[at % len(stream)] ^= flip
    whole, split = MtxReader(), MtxReader()
    expected = whole.feed_batch(bytes(stream))
    edges = sorted({0, len(stream), *(c % len(stream) for c in cuts)})
    parts = [(a, split.feed_batch(bytes(stream[a:b]))) for a, b in zip(edges, edges[1:], strict=False)]
    for name in MtBatch._fields:
        offset = [a if name == "end" else 0 for a, _ in parts]
        joined = np.concatenate([getattr(part, name) + o for o, (_, part) in zip(offset, parts, strict=True)])
        assert np.array_equal(joined, getattr(expected, name), equal_nan=True), name
    assert split.counts == whole.counts
    assert all(0 < e <= b - a for (a, part), b in zip(parts, edges[1:], strict=True) for e in part.end.tolist())


def test_a_batch_holds_what_was_sent_and_where() -> None:
    batch = MtxReader().feed_batch(b"\x00" + frame(3, 0.125) + encode_frame(0x12, b"1") + frame(4, 0.5))
    assert batch.counter.tolist() == [3, 4]
    assert batch.end.tolist() == [60, 60 + 6 + 59]
    assert batch.gyro.tolist() == [[0.125, 0.0, -1.5], [0.5, 0.0, -1.5]]
    assert batch.accel.shape == batch.mag.shape == (2, 3)
    assert batch.quaternion.tolist() == [[1.0, 0.0, 0.0, 0.0]] * 2
    assert batch.samples() == [sample(3, 0.125), sample(4, 0.5)]
    assert np.isnan(batch.celsius).all()


def test_a_frame_behind_a_false_one_is_known_when_the_false_one_ends() -> None:
    false = b"\xfa\xff\x32\x60"  # 96 bytes of payload and a checksum: 101 in all
    reader = MtxReader()
    batch = reader.feed_batch(false + frame(1) + frame(2))
    assert batch.counter.tolist() == [1, 2]
    assert batch.end.tolist() == [101, 4 + 2 * 59]


FORMATS = [
    OutputFormat(mode, settings_)
    for mode in range(16)
    for settings_ in (form | counter | orientation | absent << 4
                      for form in (0, 0x100) for counter in (0, 1) for orientation in (0, 4, 8) for absent in range(8))
]  # fmt: skip


def test_every_output_format_of_an_mtx_is_decoded() -> None:
    """1536 formats: what the simulated device packs is what comes out, to the resolution of the format."""
    half = math.sqrt(0.5)
    sent = MtSample(513, (0.5, -0.25, 9.75), (0.125, 0.0, -1.5), (0.5, 0.0, -0.875), (half, 0.0, 0.5, 0.5))
    for output in FORMATS:
        payload = pack(sent, output)
        assert len(payload) == output.length
        values, counter, present = decode_mtdata(np.frombuffer(payload, np.uint8)[None, :], output)
        assert counter[0] == (513 if output.settings & 1 else -1)
        quantities = (sent.accel, sent.gyro, sent.mag, sent.quaternion)
        for columns, expected, is_there in zip((ACCEL, GYRO, MAG, ATTITUDE), quantities, present[0], strict=True):
            found = values[0, columns]
            if not is_there:
                assert np.isnan(found).all()
                continue
            turned = found * np.sign(np.dot(found, expected)) if columns is ATTITUDE else found
            assert np.allclose(turned, expected, atol=3e-6), (output, columns)
        wanted = [output.mode & 2 and not output.settings & bit for bit in (0x10, 0x20, 0x40)] + [output.mode & 4]
        assert present[0].tolist() == [bool(w) for w in wanted]
        assert values[0, CELSIUS] == 25.0 or not output.mode & 1


def test_the_layout_is_the_one_of_the_manual() -> None:
    """Temperature, accel, gyro, mag, matrix column by column, both analog inputs, counter [MT0100P.N, 5.3.3]."""
    output = OutputFormat(0x000F, 0x0009)
    numbers = [21.5, *range(1, 10), 0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 1.0]
    payload = struct.pack(">19f2HH", *numbers, 7, 8, 4660)
    assert output.length == len(payload)
    values, counter, _ = decode_mtdata(np.frombuffer(payload, np.uint8)[None, :], output)
    assert values[0, :9].tolist() == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]
    assert (values[0, CELSIUS], counter[0]) == (21.5, 4660)
    # X to y: a quarter turn to the left
    assert np.allclose(values[0, ATTITUDE], [math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)])


def test_fixed_point_is_12_20() -> None:
    output = OutputFormat(0x0002, 0x0101)
    payload = struct.pack(">9iH", 1 << 20, -(1 << 19), 1, *range(6), 9)
    values, _, _ = decode_mtdata(np.frombuffer(payload, np.uint8)[None, :], output)
    assert values[0, :3].tolist() == [1.0, -0.5, 2.0**-20]


@pytest.mark.parametrize(
    ("mode", "settings_"), [(0x0010, 0), (0x0020, 0), (0x4002, 0), (0x8000, 0), (-1, 0), (6, 0x000C), (6, 0x200), (6, 1 << 31)]
)  # fmt: skip
def test_formats_that_no_mtx_has_are_refused(mode: int, settings_: int) -> None:
    with pytest.raises(ValueError, match="output"):
        OutputFormat(mode, settings_)


def test_other_formats_pass_the_same_gates() -> None:
    output = OutputFormat(0x0007, 0x0105)
    reader = MtxReader(output=output)
    found = reader.feed(b"".join(encode_frame(MTDATA, pack(sample(n), output)) for n in range(5)))
    assert [s.counter for s in found] == list(range(5))
    assert MtxReader().feed(encode_frame(MTDATA, pack(sample(0), output))) == []


@pytest.mark.parametrize("missing", [0x10, 0x20])
def test_a_sample_without_accel_or_gyro_is_none(missing: int) -> None:
    reader = MtxReader(output=OutputFormat(2, 1 | missing))
    assert reader.feed(encode_frame(MTDATA, pack(sample(0), OutputFormat(2, 1 | missing)))) == []
    assert reader.counts.incomplete == 1


def test_a_jump_of_the_counter_is_believed_when_the_next_one_follows_it() -> None:
    reader = MtxReader()
    found = [s.counter for n in (10, 11, 40_000, 12, 13, 3_000, 3_001, 3_002, 5, 6) for s in reader.feed(frame(n))]
    assert found == [10, 11, 12, 13, 3_000, 3_001, 3_002, 5, 6]
    assert (reader.counts.bad_counter, reader.counts.lost) == (1, 3_000 - 13 - 1)


def test_a_counter_that_jumps_back_a_little_is_not_confirmed_by_the_old_count() -> None:
    reader = MtxReader()
    assert [s.counter for s in reader.feed(b"".join(map(frame, (699, 700, 300, 701, 702))))] == [699, 700, 701, 702]
    assert (reader.counts.bad_counter, reader.counts.lost) == (1, 0)


def test_messages_that_share_the_counter_are_not_lost_samples() -> None:
    """Counters 2 and 5 are of satellite messages; 4 never came; a satellite message with the counter of its sample, 6, costs none."""
    satellites = {
        k: encode_frame(MTDATA2, b"\x10\x20\x02" + k.to_bytes(2, "big") + b"\x30\x10\x04\0\1\2\3") for k in (2, 5, 6)
    }
    stream = [frame(1), satellites[2], frame(3), satellites[5], satellites[6], frame(6), frame(7)]
    reader = MtxReader()
    assert [s.counter for s in reader.feed(b"".join(stream))] == [1, 3, 6, 7]
    assert (reader.counts.lost, reader.counts.incomplete) == (1, 3)


def test_one_device_behind_a_master_is_followed() -> None:
    stream = b"".join(
        encode_frame(MTDATA, pack_mtdata(sample(n + 1_000 * bus)), bus) for n in range(5) for bus in (1, 2, 3, 4)
    )
    reader = MtxReader()
    assert [s.counter for s in reader.feed(stream)] == [1_000, 1_001, 1_002, 1_003, 1_004]
    assert (reader.counts.other_device, reader.counts.lost, reader.counts.skipped_bytes) == (15, 0, 0)


def test_euler_angles_and_matrices_agree_with_the_quaternion() -> None:
    rng = np.random.default_rng(1)
    q = rng.standard_normal((200, 4))
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    w, x, y, z = q.T
    columns = np.stack(
        [
            1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y),
            2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x),
            2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y),
        ],
        axis=1,
    )  # fmt: skip
    euler = np.degrees(
        np.stack(
            [
                np.arctan2(columns[:, 5], columns[:, 8]),
                -np.arcsin(columns[:, 2]),
                np.arctan2(columns[:, 1], columns[:, 0]),
            ],
            axis=1,
        )
    )
    for found in (axes.from_matrix(columns), axes.from_euler(euler)):
        assert np.allclose(np.abs(np.einsum("ni,ni->n", found, q)), 1.0, atol=1e-9)
        assert np.allclose(np.linalg.norm(found, axis=1), 1.0)
    columns[:, 4] += 0.1
    assert not axes.from_matrix(columns).any()
    assert not axes.from_euler(np.array([[0.0, 91.0, 0.0], [np.nan, 0.0, 0.0], [200.0, 0.0, 0.0]])).any()


def turned(q: np.ndarray, vector: tuple[float, float, float]) -> np.ndarray:
    """A vector turned by one quaternion."""
    pure = axes.product(q, np.array([[0.0, *vector]]))
    return axes.product(pure[0], np.array([[q[0], -q[1], -q[2], -q[3]]]))[0, 1:]


@pytest.mark.parametrize(
    ("world", "north", "west", "up"),
    [
        (axes.ENU, (0.0, 1.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
        (axes.NED, (1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, -1.0)),
        (axes.NWU, (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
    ],
)
def test_every_world_becomes_the_mts(
    world: int, north: tuple[float, float, float], west: tuple[float, float, float], up: tuple[float, float, float]
) -> None:
    """A sensor that lies along the axes of its world: what is north there is the x axis of the MT world."""
    q = axes.to_mt_world(np.array([[1.0, 0.0, 0.0, 0.0]]), world)[0]
    assert np.allclose([turned(q, v) for v in (north, west, up)], np.eye(3), atol=1e-12)


@pytest.mark.parametrize("split", [1, 7, 59, 10_000])
def test_a_sample_that_repeats_while_its_counter_goes_on_is_none(split: int) -> None:
    stream = b"".join(frame(n, 0.5 if 20 <= n < 50 else None) for n in range(60))
    reader = MtxReader()
    found = [s.counter for k in range(0, len(stream), split) for s in reader.feed(stream[k : k + split])]
    assert found == [*range(20 + HELD), *range(50, 60)]
    assert (reader.counts.repeated, reader.counts.good) == (30 - HELD, 30 + HELD)


def test_noise_full_of_preambles_costs_no_more() -> None:
    """The longest possible false frame at every place: 2 MB must not take minutes."""
    reader = FrameReader()
    reader.scan(b"")
    noise = b"\xfa\xff\x32\xff\x08\x00" * 350_000
    began = time.process_time()
    reader.scan(noise)
    assert time.process_time() - began < 20.0  # a hang is found, not slowness


@given(st.binary(max_size=5000))
def test_noise_never_raises_and_memory_is_bounded(noise: bytes) -> None:
    reader = FrameReader()
    reader.feed(noise)
    assert reader.pending <= 2048 + 6


@pytest.mark.parametrize(
    ("bad", "reason"),
    [
        (sample(1)._replace(accel=(math.nan, 0.0, 0.0)), "not_finite"),
        (sample(1)._replace(gyro=(math.inf, 0.0, 0.0)), "not_finite"),
        (sample(1)._replace(accel=(300.0, 0.0, 0.0)), "out_of_range"),
        (sample(1)._replace(gyro=(0.0, -40.0, 0.0)), "out_of_range"),
        (sample(1)._replace(quaternion=(0.9, 0.0, 0.0, 0.0)), "bad_quaternion"),
        (sample(1)._replace(mag=(math.nan, math.nan, math.nan)), "not_finite"),
        (sample(1)._replace(quaternion=(math.nan,) * 4), "not_finite"),
        (sample(1)._replace(mag=(0.0, 21.0, 0.0)), "out_of_range"),
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


@pytest.mark.parametrize("form", range(4))
@pytest.mark.parametrize("world", [axes.ENU, axes.NED, axes.NWU])
def test_every_number_format_and_world(form: int, world: int) -> None:
    half = 2.0**-0.5
    sent = {
        0x2010: (half, 0.0, half, 0.0),
        0x4020: (0.5, -9.75, 2.25),
        0x8020: (-0.125, 1.5, 0.0),
        0xC020: (1.0, -0.5, 0.0),
    }
    payload = b"\x10\x20\x02\x12\x34"
    for identifier, values in sent.items():
        content = b"".join(NUMBERS[form](value) for value in values)
        payload += struct.pack(">HB", identifier | form | world, len(content)) + content
    batch = MtxReader().feed_batch(encode_frame(MTDATA2, payload))
    assert batch.counter.tolist() == [0x1234]
    assert (batch.accel[0].tolist(), batch.gyro[0].tolist()) == (list(sent[0x4020]), list(sent[0x8020]))
    assert batch.mag[0].tolist() == list(sent[0xC020])
    assert np.allclose(batch.quaternion, axes.to_mt_world(np.array([sent[0x2010]]), world), atol=1e-6)


NUMBERS = (
    lambda v: struct.pack(">f", v),
    lambda v: struct.pack(">i", round(v * 2**20)),
    lambda v: struct.pack(">Ih", round(v * 2**32) & 0xFFFFFFFF, math.floor(v)),
    lambda v: struct.pack(">d", v),
)


@pytest.mark.parametrize(
    "payload", ["10", "102002", "10200212", "1020031234 00", "40200400000000", "1020021234 4020ff", "402c0c" + 24 * "0"]
)
def test_packets_that_do_not_add_up_are_counted(payload: str) -> None:
    reader = MtxReader()
    assert reader.feed(encode_frame(MTDATA2, bytes.fromhex(payload.replace(" ", "")))) == []
    assert reader.counts.bad_length == 1
