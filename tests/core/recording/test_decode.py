# SPDX-License-Identifier: MIT
"""Bytes of an MT, decoded: every valid frame comes out, and nothing of it is dropped.

Captured logs: the twin's own captures decode to their golden text.
"""

from __future__ import annotations

import json
import math
import random
import struct
from collections import Counter
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import echostep
from board_runs import ROOT
from echostep.errors import EchostepError
from echostep.recording import Decoder, as_json, port_of_bytes, read_capture
from echostep.xsens import MTDATA, MTDATA2, MtMessage, MtSample, OutputFormat, encode_frame
from echostep.xsens.message import MessageReader
from echostep.xsens.output_formats import BY_LENGTH, CONFIGURED, GIVEN, OutputFormats
from echostep_simulation.devices.mtx_formats import pack
from naive.frames import valid_frames

HALF = math.sqrt(0.5)


def sample(counter: int) -> MtSample:
    return MtSample(counter, (0.5, -0.25, 9.75), (0.125, 0.0, -1.5), (0.5, 0.0, -0.875), (HALF, 0.0, HALF, 0.0))


def legacy(counter: int, mode: int = 6, bits: int = 1, bus: int = 0xFF) -> bytes:
    return encode_frame(MTDATA, pack(sample(counter), OutputFormat(mode, bits)), bus)


def packets(*contents: tuple[int, bytes]) -> bytes:
    return b"".join(struct.pack(">HB", identifier, len(content)) + content for identifier, content in contents)


def counter(value: int) -> tuple[int, bytes]:
    return 0x1020, struct.pack(">H", value)


ACCEL, GYRO = (0x4020, struct.pack(">3f", 0.5, -0.25, 9.75)), (0x8020, struct.pack(">3f", 0.125, 0.0, -1.5))
KINDS = (
    legacy(1), legacy(2, 2, 0), legacy(3, bus=4), encode_frame(MTDATA2, packets(counter(7), ACCEL, GYRO)), encode_frame(0x3E),
    encode_frame(MTDATA2, packets((0x2010, struct.pack(">4f", HALF, 0.0, HALF, 0.0))), 2), encode_frame(MTDATA2, b"\x10\x20\x09"),
    encode_frame(0x0D, bytes(118)), encode_frame(0x99, bytes(300), 32), b"\xfa\xff\x32\xff\x08\x00", b"\xfa\x01\x36\xfe", b"\x00", b"\xfa",
    encode_frame(MTDATA2, packets((0x7010, bytes(94)), counter(8), (0xF0F0, b"abc"))), encode_frame(MTDATA, bytes(7)),
)  # fmt: skip


def decoded(capture: bytes, folder: Path, decoder: Decoder | None = None) -> list[MtMessage]:
    """The MT's messages of a capture, each of which must be possible as JSON."""
    path = folder / "capture.bin"
    path.write_bytes(capture)
    found = [message for message in read_capture(path, decoder) if isinstance(message, MtMessage)]
    for message in found:
        json.dumps(as_json(message), allow_nan=False)
    return found


@settings(max_examples=150, deadline=None)
@given(
    st.lists(st.integers(0, len(KINDS) - 1), min_size=1, max_size=30),
    st.lists(st.tuples(st.integers(0, 4000), st.integers(1, 255)), max_size=5),
    st.integers(0, 60),
)
def test_every_valid_frame_of_any_stream_comes_out(
    tmp_path_factory: pytest.TempPathFactory, kinds: list[int], flips: list[tuple[int, int]], missing: int
) -> None:
    stream = bytearray(b"".join(KINDS[k] for k in kinds))
    for at, flip in flips:
        stream[at % len(stream)] ^= flip
    path = tmp_path_factory.mktemp("captures") / "capture.bin"
    path.write_bytes(bytes(stream[: max(len(stream) - missing, 1)]))
    expect_every_frame(path)


def expect_every_frame(path: Path) -> None:
    """The messages of a capture are its valid frames, by the slow count; without one, the file is refused."""
    expected = [(bus, mid) for bus, mid, _ in valid_frames(path.read_bytes())]
    if not expected:
        with pytest.raises(EchostepError, match="neither board frames nor Xbus"):
            list(read_capture(path))
        return
    found = [message for message in read_capture(path) if isinstance(message, MtMessage)]
    assert [(message.bus, message.mid) for message in found] == expected


def test_a_frame_behind_much_noise_is_found(tmp_path: Path) -> None:
    assert [message.counter for message in decoded(bytes(200_000) + legacy(9), tmp_path)] == [9]


def test_no_jump_of_the_counter_costs_a_frame(tmp_path: Path) -> None:
    counters = [10, 11, 40_000, 12, 3_000, 3_001, 3_003, 5]
    decoder = Decoder()
    found = decoded(b"".join(map(legacy, counters)), tmp_path, decoder)
    assert [message.counter for message in found] == counters
    gaps = decoder.mt.gaps[0xFF]
    assert (gaps.lost, gaps.jumps) == (1, 4)


def test_satellite_messages_with_counters_of_their_own_are_not_lost(tmp_path: Path) -> None:
    satellites = encode_frame(MTDATA2, packets(counter(2), (0x7010, bytes(94))))
    stream = [encode_frame(MTDATA2, packets(counter(k), ACCEL, GYRO)) for k in (1, 3, 4)]
    decoder = Decoder()
    found = decoded(stream[0] + satellites + stream[1] + stream[2], tmp_path, decoder)
    assert [(message.name, message.counter) for message in found] == [
        ("MtSample", 1),
        ("MTData2", 2),
        ("MtSample", 3),
        ("MtSample", 4),
    ]
    assert decoder.mt.gaps[0xFF].lost == decoder.tracked.counts.lost == 0


def test_devices_behind_a_master_are_told_apart(tmp_path: Path) -> None:
    decoder = Decoder()
    found = decoded(b"".join(legacy(n, bus=bus) for n in range(3) for bus in (1, 2, 3, 4)), tmp_path, decoder)
    assert [(message.bus, message.counter) for message in found] == [(bus, n) for n in range(3) for bus in (1, 2, 3, 4)]
    assert as_json(found[1])["bus"] == 2
    assert all(gaps.lost == gaps.jumps == 0 for gaps in decoder.mt.gaps.values())


def test_nothing_of_a_message_is_dropped(tmp_path: Path) -> None:
    """MTw and MTi packets: sample time, delta velocity and rotation, pressure, position, status, signal; unknown ones and wrong sizes as hex."""
    payload = packets(
        counter(5), (0x1060, struct.pack(">I", 77)), (0x4010, struct.pack(">3f", 0.5, 0.25, 1.0)), (0x8030, struct.pack(">4f", 1, 0, 0, 0)),
        (0x3010, struct.pack(">I", 100_000)), (0x5040, struct.pack(">2f", 47.5, 8.5)), (0xE020, struct.pack(">I", 3)), (0xE040, b"\xc0"),
        (0xF0F0, b"\xab\xcd"), (0x1070, b"\x01"),
    )  # fmt: skip
    (message,) = decoded(encode_frame(MTDATA2, payload, 3), tmp_path)
    told: list[dict[str, Any]] = as_json(message)["packets"]
    assert as_json(message)["message"] == "MTData2"
    assert told == [
        {"name": "SampleTimeFine", "value": 77}, {"name": "DeltaV", "X": 0.5, "Y": 0.25, "Z": 1.0},
        {"name": "DeltaQ", "Q0": 1, "Q1": 0, "Q2": 0, "Q3": 0},
        {"name": "BaroPressure", "value": 100_000}, {"name": "LatLon", "Lat": 47.5, "Lon": 8.5}, {"name": "StatusWord", "value": 3},
        {"name": "Rssi", "value": -64}, {"id": "0xF0F0", "hex": "abcd"}, {"id": "0x1070", "name": "SampleTimeCoarse", "hex": "01"},
    ]  # fmt: skip


@pytest.mark.parametrize(("bits", "name"), [(0, "east, north, up"), (4, "north, east, down"), (8, "north, west, up")])
def test_a_quaternion_is_given_in_the_frame_it_came_in(bits: int, name: str, tmp_path: Path) -> None:
    capture = encode_frame(MTDATA2, packets((0x2010 | bits, struct.pack(">4f", 0.5, -0.5, 0.5, -0.5))))
    (message,) = decoded(capture, tmp_path)
    assert as_json(message) == {"message": "MtSample", "quaternion": [0.5, -0.5, 0.5, -0.5], "world": name}


def test_what_is_no_number_becomes_null(tmp_path: Path) -> None:
    (message,) = decoded(
        encode_frame(MTDATA2, packets((0x4020, struct.pack(">3f", math.nan, math.inf, 1.0)))), tmp_path
    )
    assert as_json(message) == {"message": "MtSample", "accel": [None, None, 1.0]}


def test_configuration_and_unknown_messages_come_out(tmp_path: Path) -> None:
    device = struct.pack(">IHHI8x", 0x0035_0011, 36, 2, 0)
    capture = encode_frame(0x0D, bytes(96) + struct.pack(">H", 1) + device) + encode_frame(0x99, b"\x01\x02")
    first, second = (as_json(message) for message in decoded(capture, tmp_path))
    assert (first["message"], first["name"]) == ("MtMessage", "Configuration")
    assert first["packets"] == [
        {"device": "00350011", "length": 36, "output_mode": "0x0002", "output_settings": "0x00000000"}
    ]
    assert second == {"message": "MtMessage", "id": "0x99", "hex": "0102"}


@pytest.mark.parametrize(
    ("mode", "bits"),
    [
        (2, 0),
        (2, 1),
        (6, 0),
        (6, 1),
        (6, 4),
        (6, 5),
        (6, 9),
        (4, 1),
        (4, 0),
        (2, 0x41),
        (2, 0x40),
        (3, 1),
        (7, 1),
        (2, 0x101),
        (6, 0x101),
    ],
)
def test_the_format_of_legacy_data_is_found_from_the_length_and_the_values(mode: int, bits: int) -> None:
    """36 bytes (accel, gyro, mag) among them. The values of a walk in which nothing is still."""
    reader = MessageReader()
    found = reader.feed(b"".join(legacy(n, mode, bits) for n in range(40)))
    output = OutputFormat(mode, bits)
    assert reader.formats.found == {(0xFF, output.length): (output, BY_LENGTH)}
    assert [message.counter for message in found] == [n if bits & 1 else None for n in range(40)]
    assert (found[0].accel is not None, found[0].quaternion is not None) == (mode & 2 > 0, mode & 4 > 0)


def test_the_format_is_what_the_caller_says() -> None:
    """24 bytes are accel and gyro by their values; the caller knows that they are accel and mag."""
    said = OutputFormats(2, 0x20)
    reader = MessageReader(said)
    (message,) = reader.feed(legacy(0, 2, 0x20))
    assert (message.accel, message.gyro, message.mag) == (sample(0).accel, None, sample(0).mag)
    assert said.found[0xFF, 24] == (OutputFormat(2, 0x20), GIVEN)


@pytest.mark.parametrize("told", ["configuration", "answers"])
def test_the_format_is_what_the_capture_says(told: str) -> None:
    device = struct.pack(">IHHI8x", 0x0035_0011, 24, 2, 0x20)
    head = {
        "configuration": encode_frame(0x0D, bytes(96) + struct.pack(">H", 1) + device),
        "answers": encode_frame(0xD1, b"\0\2") + encode_frame(0xD3, b"\0\0\0\x20"),
    }[told]
    reader = MessageReader()
    message = reader.feed(head + legacy(0, 2, 0x20))[-1]
    assert (message.gyro, message.mag) == (None, sample(0).mag)
    assert reader.formats.found[0xFF, 24] == (OutputFormat(2, 0x20), CONFIGURED)


def test_legacy_data_of_no_format_come_out_as_hex(tmp_path: Path) -> None:
    decoder = Decoder()
    (message,) = decoded(encode_frame(MTDATA, b"\x7f\xff" * 20), tmp_path, decoder)
    assert as_json(message) == {"message": "MTData", "hex": "7fff" * 20}


def test_the_rest_of_legacy_data_comes_out() -> None:
    """Both analog inputs and the status, and raw data."""
    analog = struct.pack(">9fHHBH", 0.5, -0.25, 9.75, *[0.0] * 6, 7, 8, 5, 513)
    (message,) = MessageReader(OutputFormats(0x080A, 1)).feed(encode_frame(MTDATA, analog))
    assert as_json(message)["packets"] == [{"name": "analog", "value": [7, 8]}, {"name": "status", "value": 5}]
    (message,) = MessageReader(OutputFormats(0x4000, 1)).feed(
        encode_frame(MTDATA, struct.pack(">11H", *range(10), 513))
    )
    assert as_json(message) == {
        "message": "MTData",
        "counter": 513,
        "packets": [{"name": "raw", "value": list(range(10))}],
    }


@pytest.mark.parametrize("counter", [0, 1])
def test_utc_time_is_what_the_configuration_says_and_never_taken_for_angles(tmp_path: Path, counter: int) -> None:
    date = struct.pack(">IH6B", 990_000_000, 2026, 11, 27, 10, 0, 2, 7)
    rows = [
        struct.pack(">9f", 0, 0, 9.81, 0, 0, 0, 0.4, 0.1, -0.7) + date + struct.pack(">H", k)[: 2 * counter]
        for k in range(50)
    ]
    sent = b"".join(encode_frame(0x32, row) for row in rows)
    device = struct.pack(">IHHI8x", 0x00300001, len(rows[0]), 2, 2 + counter)
    (tmp_path / "a.bin").write_bytes(encode_frame(0x0D, bytes(96) + struct.pack(">H", 1) + device) + sent)
    samples = [as_json(m) for m in read_capture(tmp_path / "a.bin") if isinstance(m, MtMessage)][1:]
    assert len(samples) == 50
    assert samples[-1]["packets"] == [{"name": "utc", "value": [990_000_000, 2026, 11, 27, 10, 0, 2, 7]}]
    assert samples[-1].get("counter") == (49 if counter else None)
    (tmp_path / "a.bin").write_bytes(sent)  # without the configuration
    assert all("quaternion" not in as_json(m) for m in read_capture(tmp_path / "a.bin"))


def test_bytes_with_frames_by_chance_are_no_capture(tmp_path: Path) -> None:
    for seed in range(5):
        (tmp_path / "a.bin").write_bytes(random.Random(seed).randbytes(300_000))
        assert port_of_bytes(tmp_path / "a.bin") is None


CAPTURES = ROOT / "tests/captures"
NAMES = ("board.bin", "mtx.bin", "walk.mcap")


@pytest.mark.parametrize("name", NAMES)
def test_a_capture_decodes_to_its_golden_text(name: str) -> None:
    golden = [json.loads(line) for line in (CAPTURES / name).with_suffix(".jsonl").read_text().splitlines()]
    found = [json.loads(json.dumps(as_json(message))) for message in echostep.read_capture(CAPTURES / name)]
    assert found == golden
    assert len(found) > 300


def test_the_missing_bytes_are_counted() -> None:
    decoder = Decoder()
    kinds = Counter(type(message).__name__ for message in read_capture(CAPTURES / "board.bin", decoder))
    counts = decoder.board.counts
    assert 1 <= counts.rejected <= 2
    assert 1 <= counts.lost <= 5
    assert {"Identity", "Configuration", "Ping", "Gyros", "Pressure", "Compass", "Sync", "Status", "GyroHealth"} == set(
        kinds
    )


@pytest.mark.parametrize("content", [b"", b"hello world", bytes(1000), b"\x89MCAP0\r\n" + bytes(50)])
def test_what_is_no_capture_is_named(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "x.bin").write_bytes(content)
    with pytest.raises(EchostepError, match=r"x\.bin"):
        list(read_capture(tmp_path / "x.bin"))
