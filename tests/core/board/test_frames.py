# SPDX-License-Identifier: MIT
"""Board frames: golden vectors, any split of any stream, damage that stays local, a stale firmware.

What serial lines add to a board's bytes costs the frames that it touches alone, and each is counted.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable

import pytest
from cobs import cobs
from hypothesis import given
from hypothesis import strategies as st

from board_runs import ROOT
from echostep.board import messages as m
from echostep.board.frames import BoardReader, FrameCounts, StaleFirmwareError, crc, encode
from naive.frames import BoardReader as NaiveReader
from waiting import ran

VECTORS = [json.loads(line) for line in (ROOT / "protocol/vectors.jsonl").read_text().splitlines()]
CLASSES = {kind.__name__.lower(): kind for kind in m.BY_ID.values()}


def message_of(vector: dict[str, object]) -> m.Message:
    fields = vector["fields"]
    assert isinstance(fields, dict)
    return CLASSES[str(vector["message"]).replace("_", "")](**fields)


def gyros(n: int) -> m.Gyros:
    return m.Gyros(ticks=n * 10_000, thigh=n % 7, calf=-(n % 5), belt=0)


@pytest.mark.parametrize(
    "vector", [v for v in VECTORS if "message" in v], ids=lambda v: f"{v['message']}-{v['sequence']}"
)
def test_vectors_encode_and_decode(vector: dict[str, object]) -> None:
    message = message_of(vector)
    frame = bytes.fromhex(str(vector["frame"]))
    assert encode(message, int(str(vector["sequence"]))) == frame
    if isinstance(message, m.Identity):  # its golden values hold foreign schema hashes
        with pytest.raises(StaleFirmwareError):
            BoardReader().feed(frame)
    else:
        assert BoardReader().feed(frame) == [message]


@pytest.mark.parametrize(
    "vector", [v for v in VECTORS if "cobs" in v], ids=lambda v: f"{v['cobs']}-{len(v['plain']) // 2}"
)
def test_cobs_vectors(vector: dict[str, str]) -> None:
    assert cobs.encode(bytes.fromhex(vector["plain"])).hex() == vector["encoded"]


@pytest.mark.process
def test_generated_files_are_fresh() -> None:
    done = ran([sys.executable, ROOT / "protocol/generate.py", "--check"])
    assert done.returncode == 0, done.stdout


def seen(reader: BoardReader | NaiveReader, parts: list[bytes]) -> tuple[list[m.Message], FrameCounts, bool]:
    """Messages and counts, and whether a stale firmware ended it."""
    found: list[m.Message] = []
    try:
        for part in parts:
            found += reader.feed(part)
    except StaleFirmwareError:
        return [], FrameCounts(), True
    return found, reader.counts, False


@given(
    st.lists(st.one_of(st.sampled_from([v["frame"] for v in VECTORS if "message" in v]), st.none()), max_size=40),
    st.lists(st.tuples(st.integers(0, 2_000), st.integers(0, 255)), max_size=8),
    st.lists(st.integers(0, 2_000), max_size=5),
)
def test_like_the_naive_twin(frames: list[str | None], damage: list[tuple[int, int]], cuts: list[int]) -> None:
    stream = bytearray(b"".join(encode(gyros(n), n) if f is None else bytes.fromhex(f) for n, f in enumerate(frames)))
    for at, value in damage:
        if at < len(stream):
            stream[at] = value
    edges = sorted({0, len(stream), *(min(c, len(stream)) for c in cuts)})
    parts = [bytes(stream[a:b]) for a, b in zip(edges, edges[1:], strict=False)]
    assert seen(BoardReader(), parts) == seen(NaiveReader(), parts)


def test_frames_end_where_their_zero_is() -> None:
    stream = b"".join(encode(gyros(n), n) for n in range(5))
    reader = BoardReader()
    ends = reader.frames(stream[:30]).end.tolist() + (30 + reader.frames(stream[30:]).end).tolist()
    assert ends == [at + 1 for at, octet in enumerate(stream) if octet == 0]


@given(st.binary(max_size=4000))
def test_noise_never_raises_and_memory_is_bounded(noise: bytes) -> None:
    reader = BoardReader()
    try:
        reader.feed(noise)
    except StaleFirmwareError:
        pytest.fail("noise passed for an identity")
    assert len(reader._rest) <= 66


@pytest.mark.parametrize("length", [253, 254, 255, 256])
def test_overlong_frames_are_counted_and_skipped(length: int) -> None:
    reader = BoardReader()
    found = reader.feed(cobs.encode(b"\1" * length) + b"\0" + encode(gyros(1), 0))
    assert found == [gyros(1)]
    assert reader.counts.bad_length == 1


def test_stale_firmware_names_both_hashes() -> None:
    stale = m.Identity(0, 0xDEADBEEF, 1, 0, 0, 1)
    with pytest.raises(StaleFirmwareError, match=rf"0xDEADBEEF.*0x{m.SCHEMA_HASH:08X}"):
        BoardReader().feed(encode(stale, 0))


def test_a_foreign_identity_amid_good_frames_is_noise() -> None:
    reader = BoardReader()
    reader.feed(encode(gyros(0), 0))
    assert reader.feed(encode(m.Identity(0, 0xDEADBEEF, 1, 0, 0, 1), 1)) == []
    assert reader.counts.bad_message == 1


def test_frames_of_another_schema_fail_their_checksum() -> None:
    plain = bytes([0x03, 0, 0]) + gyros(1).pack()
    import binascii

    payload = plain + binascii.crc_hqx(plain, m.SCHEMA_SEED ^ 1).to_bytes(2, "little")
    reader = BoardReader()
    assert reader.feed(cobs.encode(payload) + b"\0") == []
    assert reader.counts.bad_crc == 1


def test_lost_sequence_numbers_are_counted_across_the_wrap() -> None:
    reader = BoardReader()
    for sequence in (65534, 65535, 2, 3):
        reader.feed(encode(gyros(1), sequence))
    assert reader.counts.lost == 2


OF_FIRMWARE_1_9 = {  # frames, sequence 1, all fields at their greatest
    m.Status: "0307012fffffffffffffffffffffffffffffffffffffffffffffffffffffffffffffffffffff09090909090909ffffffe79c00",
    m.Configuration: "0309010cffffffffff02ffff011e0800",
    m.Subscribe: "03850104ff74e200",
}


@pytest.mark.parametrize("kind", OF_FIRMWARE_1_9)
def test_a_message_is_read_with_and_without_the_fields_that_came_later(kind: type[m.Message]) -> None:
    """Where they are zero the frame is that of the older version; a body with half of a field, or more than all, is none."""
    reader, old = BoardReader(), bytes.fromhex(OF_FIRMWARE_1_9[kind])
    (message,) = reader.feed(old)
    assert isinstance(message, kind)
    assert tuple(message)[-1] == 0
    assert encode(message, 1) == old
    longer = kind._make((*tuple(message)[:-1], 0x81))
    assert len(encode(longer, 1)) == len(old) + 1
    frames = reader.frames(encode(longer, 2) + encode(message, 3))
    assert frames.messages() == [longer, message]
    assert [row.item()[-1] for row in frames.rows(kind)[1]] == [0x81, 0]
    for body in (message.pack()[:-1], longer.pack() + b"\1"):
        plain = bytes([message.id, 4, 0]) + body
        assert reader.feed(cobs.encode(plain + crc(message.id, plain).to_bytes(2, "little")) + b"\0") == []
        with pytest.raises(ValueError, match="bytes, expected"):
            kind.unpack(body)
    assert (reader.counts.good, reader.counts.bad_message) == (3, 2)


@pytest.mark.parametrize("value", [2, 255])
def test_unknown_enumerations_are_rejected(value: int) -> None:
    reader = BoardReader()
    assert reader.feed(encode(m.Ping(0, value, 0, 100), 0)) == []
    assert reader.counts.bad_message == 1


CAPTURE = (ROOT / "tests/captures/board.bin").read_bytes()  # it begins in the middle of a frame


def zero_inside(capture: bytes) -> bytes:
    """A zero in the eleventh frame, as by a flipped bit."""
    frames = capture.split(b"\0")
    frames[10] = frames[10][:5] + b"\0" + frames[10][5:]
    return b"\0".join(frames)


# What is done to the bytes, frames lost, frames rejected beside those of the capture
LINES: dict[str, tuple[Callable[[bytes], bytes], int, int]] = {
    "nothing": (bytes, 0, 0),
    "one byte before [electricui-embedded, issue 180]": (lambda c: b"\x55" + c, 0, 1),
    "zeros before": (lambda c: bytes(50) + c, 0, 0),
    "two delimiters a frame": (lambda c: c.replace(b"\0", b"\0\0"), 0, 0),
    "no last delimiter": (lambda c: c.rstrip(b"\0"), 1, 0),
    "a zero inside a frame [nanocobs, issue 43]": (zero_inside, 1, 2),
    "flow control by software": (lambda c: c[:3000] + b"\x11" + c[3000:6000] + b"\x13" + c[6000:], 2, 2),
    "a hundred thousand bytes of noise": (lambda c: c[:5000] + b"\xff" * 100_000 + c[5000:], 1, 1),
    "a terminal that translates line ends": (lambda c: c.replace(b"\n", b"\r\n"), 46, 46),
    "ModemManager's questions": (lambda c: b"ModemManager AT+GCAP\r" * 3 + c, 0, 1),
}


@pytest.mark.parametrize("line", LINES)
def test_only_what_is_touched_is_lost_and_it_is_counted(line: str) -> None:
    change, lost, rejected = LINES[line]
    whole, reader = BoardReader(), BoardReader()
    whole.feed(CAPTURE)
    reader.feed(change(CAPTURE))
    assert (whole.counts.good - reader.counts.good, reader.counts.rejected - whole.counts.rejected) == (lost, rejected)
    assert reader.counts.lost - whole.counts.lost in (lost, lost - (line == "no last delimiter"))
