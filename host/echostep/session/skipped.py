# SPDX-License-Identifier: MIT
"""What a replay did not use of a recording, and why.

In: a recording that was read to its end, the tracker's counts. Out: lines of text. Owns nothing.
"""

from __future__ import annotations

from echostep.recording.reading import Recording
from echostep.tracker.state import StreamState


def skipped(recording: Recording, streams: StreamState) -> list[str]:
    """One line for each kind of damage; none for a whole recording of undisturbed ports."""
    front_end = streams.front_end
    facts = [
        (recording.altered, "its checksum is wrong: bytes have changed since it was recorded"),
        (
            recording.damaged_bytes,
            f"{recording.damaged_bytes} damaged bytes in {recording.damaged_places} places were skipped",
        ),
        (recording.unreadable_chunks, f"{recording.unreadable_chunks} compressed chunks cannot be opened"),
        (
            recording.truncated,
            "the recording ends without an end record: it was not closed; all before was used",
        ),
        (
            front_end.bad_arrivals,
            f"{front_end.bad_arrivals} arrival times contradict the devices' counters and were not used",
        ),
        (front_end.clock_steps, f"the host's clock stepped or stood still {front_end.clock_steps} times"),
        (front_end.bad_times, f"{front_end.bad_times} messages had impossible times and were dropped"),
        (front_end.unknown_ports, f"{front_end.unknown_ports} chunks came from unknown ports"),
        (streams.board.rejected, f"{streams.board.rejected} damaged frames of the board were dropped"),
        (
            streams.mtx.bad_checksum,
            f"{streams.mtx.bad_checksum} damaged messages of the {streams.foot_name} were dropped",
        ),
    ]
    lines = [f"{recording.path}: {text}" for applies, text in facts if applies]
    damaged = recording.altered or recording.damaged_bytes or recording.truncated
    return (
        [*lines, f"  echostep repair {recording.path} -o OUT makes a whole file of what is readable"]
        if damaged
        else lines
    )
