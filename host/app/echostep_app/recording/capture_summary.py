# SPDX-License-Identifier: MIT
"""Summary of a capture's contents, in sentences.

In: a `Decoder` after the last byte. Out: lines of text. Owns nothing.
"""

from __future__ import annotations

from collections.abc import Iterator

from echostep.board.frames import BoardReader
from echostep.recording import Decoder
from echostep.xsens.frames import BUS_ID
from echostep.xsens.message import MessageReader
from echostep.xsens.reader import MtxCounts


def summary(decoder: Decoder) -> list[str]:
    """A line on each board's frames, lines on the MT's frames, on the format of legacy data, and on how many of them the tracker uses."""
    lines = [*_board_lines("Board", decoder.board), *_board_lines("Foot board", decoder.foot)]
    if decoder.mt.names:
        lines += [_frames_line(decoder.mt), *_format_lines(decoder.mt), *_gap_lines(decoder.mt), _tracker_line(decoder)]
    elif decoder.mt.counts.skipped_bytes:
        lines.append(f"MT: {counted(decoder.mt.counts.skipped_bytes, 'byte')} and no frame.")
    return lines


def counted(count: int, what: str, several: str = "") -> str:
    """A number with its noun: "1 byte", "2 bytes", "no bytes"."""
    return f"{count or 'no'} {what if count == 1 else several or what + 's'}"


def _joined(parts: list[str]) -> str:
    """Parts with commas and an "and"."""
    return " and ".join([", ".join(parts[:-1]), parts[-1]] if len(parts) > 1 else parts)


def _reasons(*counts: tuple[int, str]) -> str:
    """The counts above zero, as "3 of a wrong length"."""
    return _joined([f"{count} {reason}" for count, reason in counts if count])


def _board_lines(name: str, reader: BoardReader) -> Iterator[str]:
    """The frames of a board; nothing when there were none, good or bad."""
    counts = reader.counts
    if not counts.good and not counts.rejected:
        return
    reasons = _reasons(
        (counts.bad_length, "of a wrong length"),
        (counts.bad_cobs, "with bytes that are no COBS"),
        (counts.bad_crc, "with a wrong checksum"),
        (counts.bad_message, "with an unknown message"),
    )
    rejected = f", {counts.rejected} were rejected ({reasons})" if counts.rejected else ", none was rejected"
    end = f" {counted(reader.pending, 'byte')} at the end are no whole frame." if reader.pending else ""
    yield f"{name}: {counted(counts.good, 'frame')} read{rejected}; by the sequence numbers {counts.lost} never came.{end}"


def _frames_line(reader: MessageReader) -> str:
    """Frames by kind and bus, and the bytes outside them."""
    kinds: dict[str, int] = {}
    for (_, name), count in reader.names.items():
        kinds[name or "unknown message"] = kinds.get(name or "unknown message", 0) + count
    parts = [f"{count} {kind}" for kind, count in kinds.items()]
    buses = sorted({bus for bus, _ in reader.names})
    devices = "" if buses == [BUS_ID] else f" from bus {_joined([str(bus) for bus in buses])}"
    unread = f" {counted(reader.unread, 'measurement')} could not be read and came out as hex." if reader.unread else ""
    counts = reader.counts
    outside = (
        f"{counted(counts.skipped_bytes, 'byte')} outside of frames, {counted(counts.bad_checksum, 'wrong checksum')}"
    )
    return f"MT: {counted(sum(kinds.values()), 'valid frame')}{devices}: {_joined(parts)}; {outside}.{unread}"


def _format_lines(reader: MessageReader) -> Iterator[str]:
    """How legacy data were read."""
    for (bus, length), format_ in sorted(reader.formats.found.items()):
        where = "" if bus == BUS_ID else f" from bus {bus}"
        if format_ is None:
            yield f"MT: MTData of {length} bytes{where}: no output mode fits; give its mode and settings with --output-mode and --output-settings."
        else:
            settings = f"output mode 0x{format_.output.mode:04X}, output settings 0x{format_.output.settings:08X}"
            yield f"MT: MTData of {length} bytes{where}: {settings}, {format_.how}."


def _gap_lines(reader: MessageReader) -> Iterator[str]:
    """Counters that never came, and jumps."""
    for bus, gaps in sorted(reader.gaps.items()):
        where = "" if bus == BUS_ID else f" of bus {bus}"
        if gaps.lost or gaps.jumps:
            yield f"MT: the counter{where} shows {counted(gaps.lost, 'lost sample')} and {counted(gaps.jumps, 'jump')}."


def _tracker_line(decoder: Decoder) -> str:
    """The tracker's use of the same bytes."""
    counts = decoder.tracked.counts
    refused = refusals(counts)
    return f"The tracker would use {counted(counts.good, 'sample')}" + (f" and refuse {refused}." if refused else ".")


def refusals(counts: MtxCounts) -> str:
    """Numbers of the samples that the tracker does not use, each with its cause; empty for none."""
    return _reasons(
        (counts.incomplete, "without counter, accel or gyro"),
        (counts.bad_length, "of another length"),
        (counts.other_device, "of another device"),
        (counts.not_finite, "with a number that is not finite"),
        (counts.bad_quaternion, "with an impossible quaternion"),
        (counts.out_of_range, "beyond the sensor's range"),
        (counts.repeated, "with a repeated counter"),
        (counts.bad_counter, "with a counter that does not follow"),
    )
