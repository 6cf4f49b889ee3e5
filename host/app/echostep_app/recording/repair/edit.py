# SPDX-License-Identifier: MIT
"""New recordings from old ones: a piece cut out, or everything readable of a damaged file.

In: a recording. Out: a new recording, and lines of text about it. Owns nothing.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from pathlib import Path

import msgspec

from echostep.errors import EchostepError
from echostep.recording.mcap_records import port_of
from echostep_app.recording.repair.contents import Contents, damage_notes, problems_of, with_progress
from echostep_app.recording.repair.recovery import ArrivalOrder, RecordedMessage, Recovery
from echostep_app.recording.repair.rewrite import RewrittenRecording

START = "start_x_y_rad"  # metadata key
AFTER_ALL_NS = 1 << 64  # later than any recorded time

Metadata = Mapping[str, str]


class RecordedEstimate(msgspec.Struct):
    """The fields of a recorded estimate that a start needs."""

    x_m: float
    y_m: float
    heading_rad: float
    level: int = 0


def repair(path: Path, out: Path) -> list[str]:
    """Write everything readable of a recording to a complete file; raises EchostepError when no message is readable."""
    recovery, saved = Recovery(path), Contents()
    with RewrittenRecording(out, path, recovery.schemas) as rewritten:
        recovery.keep_private = rewritten.keep_private
        messages = with_progress(recovery, saved, f"repairing {path.name}")
        _copy(messages, rewritten, saved, lambda: recovery.metadata)
        if not saved.ports and not saved.derived:
            raise EchostepError(f"{path}: nothing in it can be saved: no message is readable")
        rewritten.write_damage(damage_notes(recovery, saved))
    derived = sum(saved.derived.values())
    return [
        f"{out}: {saved.chunks} chunks and {derived} derived messages, {saved.seconds:.1f} s",
        *(problems_of(recovery, saved) or ["  nothing was wrong with it"]),
    ]


def cut(path: Path, begin_s: float, end_s: float, out: Path) -> list[str]:
    """The messages from `begin_s` up to `end_s`, seconds after the recording's first chunk; raises EchostepError when there are none.

    The start position in the new metadata is the last recorded estimate before the piece. Without one it is "unknown", and a replay of the
    piece needs `--start`.
    """
    if not (math.isfinite(begin_s) and begin_s >= 0.0 and end_s > begin_s):
        raise EchostepError(
            f"--from {begin_s:g} --to {end_s:g}: expected 0 <= from < to, in seconds after the beginning"
        )
    all_messages = ArrivalOrder().correct(Recovery(path).messages())
    if (first_ns := next((m.t_ns for m in all_messages if port_of(m.channel)), None)) is None:
        raise EchostepError(f"{path}: no recorded bytes in it: is this an echostep recording (.mcap)?")
    begin_ns = first_ns + round(begin_s * 1e9)
    end_ns = first_ns + round(end_s * 1e9) if math.isfinite(end_s) else AFTER_ALL_NS
    start = _start_at(path, begin_ns) if begin_s > 0.0 else None
    recovery, contents = Recovery(path), Contents()

    def metadata() -> Metadata:
        new_start = {} if begin_s == 0.0 else {START: start or "unknown"}
        return {**recovery.metadata, **new_start, "cut": f"{begin_s:g} to {end_s:g} s of {path.name}"}

    with RewrittenRecording(out, path, recovery.schemas) as rewritten:
        messages = (m for m in with_progress(recovery, contents, f"cutting {path.name}") if begin_ns <= m.t_ns < end_ns)
        _copy(messages, rewritten, contents, metadata)
        if not contents.ports:
            raise EchostepError(
                f"{path}: nothing was recorded from {begin_s:g} to {end_s:g} s; see echostep info {path}"
            )
        rewritten.write_damage(damage_notes(recovery, contents))
    lines = [f"{out}: {contents.chunks} chunks, {contents.seconds:.1f} s", *problems_of(recovery, contents)]
    if begin_s > 0.0 and start is None:
        lines.append("The position at the start of the piece is not recorded: replay it with --start X,Y,DEG")
    return lines


def _copy(
    messages: Iterable[RecordedMessage],
    rewritten: RewrittenRecording,
    counted: Contents,
    metadata: Callable[[], Metadata],
) -> None:
    """Write the metadata known at the first message, then all messages, and count them."""
    for message_index, message in enumerate(messages):
        if not message_index:
            rewritten.write_metadata(metadata())
        counted.add(message)
        rewritten.write(message)


def _start_at(path: Path, t_ns: int) -> str | None:
    """The last recorded estimate up to a time as metadata `START` (x m, y m, heading rad, level), or None."""
    start = None
    for message in Recovery(path).messages():
        if message.channel.topic == "/estimate" and message.t_ns <= t_ns:
            with suppress(UnicodeError, RecursionError, msgspec.MsgspecError):
                at = msgspec.json.decode(message.body, type=RecordedEstimate)
                start = f"{at.x_m!r},{at.y_m!r},{at.heading_rad!r},{at.level}"
    return start
