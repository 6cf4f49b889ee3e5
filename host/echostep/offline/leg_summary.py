"""The track of a recorded leg as a CSV file and in words.

In: `LegTrack`. Out: a file with `TRACK_COLUMNS`, one line of text. Owns nothing.
"""

from __future__ import annotations

import csv
from pathlib import Path

from echostep.errors import EchostepError
from echostep.legs.stride import Flag, distance_sd_m
from echostep.offline.leg_track import LegTrack

TRACK_COLUMNS = ("t_s", "distance_m", "speed_m_s", "heading_rad", "x", "y")
PARTIAL = Flag.EDGE | Flag.STANDING | Flag.UNSEEN | Flag.BACKWARD | Flag.GAP  # not a whole stride of known length
FLAG_WORDS = {
    Flag.SLOW: "slow", Flag.FAST: "fast", Flag.TURNING: "turning", Flag.STAIRS_UP: "up stairs", Flag.STAIRS_DOWN: "down stairs",
    Flag.UNSEEN: "in place or sideways, not counted", Flag.BACKWARD: "backward, not counted", Flag.GAP: "gaps bridged by pace",
}  # fmt: skip


def write_leg_track(path: Path | str, track: LegTrack) -> None:
    """`TRACK_COLUMNS`, a row a sample (the paper's: ten a second); raises EchostepError when the file cannot be written."""
    try:
        with Path(path).open("w", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(TRACK_COLUMNS)
            writer.writerows([f"{v:.6f}" for v in row] for row in track.rows.tolist())
    except OSError as error:
        raise EchostepError(f"{path}: cannot write the track: {error.strerror}") from error


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
