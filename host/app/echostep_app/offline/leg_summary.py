# SPDX-License-Identifier: MIT
"""The track of a recorded leg as a CSV file and in words.

In: `LegTrack`. Out: a file with `TRACK_COLUMNS`, a summary in one line, a line a stride. Owns nothing.
"""

from __future__ import annotations

import csv
from pathlib import Path

from echostep.file_mode import claim
from echostep.legs.stride import Flag
from echostep_app.offline.leg_side import distance_sd_m
from echostep_app.offline.leg_track import LegTrack
from echostep_app.printing.lines import as_error

TRACK_COLUMNS = ("t_s", "distance_m", "speed_m_s", "heading_rad", "x", "y")
PARTIAL = Flag.EDGE | Flag.STANDING | Flag.UNSEEN | Flag.BACKWARD | Flag.GAP  # not a whole stride of known length
MOST_LISTED = 40  # strides: a screenful
FLAG_WORDS = {
    Flag.SLOW: "slow", Flag.FAST: "fast", Flag.TURNING: "turning", Flag.STAIRS_UP: "up stairs", Flag.STAIRS_DOWN: "down stairs",
    Flag.UNSEEN: "in place or sideways, not counted", Flag.BACKWARD: "backward, not counted", Flag.GAP: "gaps bridged by pace",
}  # fmt: skip


def write_leg_track(path: Path | str, track: LegTrack) -> None:
    """`TRACK_COLUMNS`, a row a sample (the paper's: ten a second); raises EchostepError when the file cannot be written."""
    with (
        as_error(f"{path}: cannot write the track"),
        claim(Path(path)).open("w", encoding="utf-8", newline="") as file,
    ):
        writer = csv.writer(file)
        writer.writerow(TRACK_COLUMNS)
        writer.writerows([f"{v:.6f}" for v in row] for row in track.rows.tolist())


def describe_legs(track: LegTrack) -> str:
    """Distance with its standard deviation, strides, speed, source of the heading, counts, flags and notes, in one line."""
    distance = track.distance_m
    if track.counts is None:
        return f"{distance:.2f} m by [Lee 2010]; heading: {track.source}"
    whole = [s for s in track.strides if not s.flags & PARTIAL]
    moving_s = sum(s.t_end_s - s.t_start_s for s in track.strides if s.length_m > 0.0)
    speed = distance / moving_s if moving_s > 0.0 else 0.0
    flags = [f"{n} {word}" for flag, word in FLAG_WORDS.items() if (n := sum(flag in s.flags for s in track.strides))]
    skipped = track.counts.impossible + track.counts.not_later
    return (
        f"{distance:.2f} m, known to {distance_sd_m(track.strides):.2f} m (1 sd); {len(whole)} whole strides, {speed:.2f} m/s while walking; "
        f"heading: {track.source}; {track.counts.samples} samples, {skipped} skipped, {track.counts.gaps} gaps"
        + "".join(f"; {flag}" for flag in flags)
        + "".join(f"; {note}" for note in track.notes)
    )


def describe_strides(track: LegTrack) -> list[str]:
    """A line for each stride: when, length with its own standard deviation, speed, what it is; of a long walk the first MOST_LISTED."""
    steps = [s for s in track.strides if Flag.STANDING not in s.flags]
    lines = []
    for number, stride in enumerate(steps[:MOST_LISTED], start=1):
        words = ["beginning or end of a walk"] if Flag.EDGE in stride.flags else []
        words += [word for flag, word in FLAG_WORDS.items() if flag in stride.flags]
        lines.append(
            f"stride {number}: {stride.t_start_s:.2f} to {stride.t_end_s:.2f} s, {stride.length_m:.2f} m "
            f"(sd {stride.length_sd_m:.2f}), {stride.speed_m_s:.2f} m/s" + "".join(f"; {word}" for word in words)
        )
    more = len(steps) - MOST_LISTED
    return [*lines, f"and {more} more"] if more > 0 else lines
