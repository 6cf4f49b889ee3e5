# SPDX-License-Identifier: MIT
"""The track of a recorded leg, by this project's method; as a file and in words; the lengths that it takes.

In: `LegSamples`, `StrideSettings`. Out: `LegTrack`. Owns nothing. The estimators are the same as live.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from echostep.arrays import Bools, Floats
from echostep.errors import EchostepError
from echostep.file_mode import write_csv
from echostep.legs.heading import BIAS, Heading
from echostep.legs.kinematics import USUAL_M, LegLengths
from echostep.legs.stride import Flag, LegCounts, Stride, StrideSettings
from echostep.legs.strides import StrideEstimator
from echostep_app.offline.leg_csv import LegSamples
from echostep_app.offline.leg_gyros import repair_clipping
from echostep_app.offline.leg_side import about_trunk, distance_sd_m
from echostep_app.printing.lines import as_error

# All assumed.
START_SD_RAD = math.radians(3.0)  # of a heading given for the start, as read from a plan
TURNING_RAD_S = math.radians(25.0)  # mean rate of a stride that is flagged as turning: 28 degrees in 1.1 s
SHORTEST_TURN_S = 0.3  # a shorter stride is not flagged: strides take about 1 s
STANDING_MARGIN_S = 0.2  # left out at either end of standing: a leg may move there
# Least turning that shows the sign of the belt's gyro: far above the compass's errors (8 degrees).
SIGN_TURN_RAD = math.radians(30.0)
FEWEST_READINGS = 20  # of the compass that show it: single outliers do not decide


@dataclass(frozen=True, slots=True)
class LegTrack:
    """`rows` (n, 6): time s, distance m, speed m/s, heading rad, x, y m. `strides`: none by the paper's method.

    `source`: sensors of the heading, in words; `heading_sd_rad`: at the end. `notes`: a line each.
    """

    rows: Floats
    strides: tuple[Stride, ...]
    counts: LegCounts | None
    source: str
    heading_sd_rad: float
    notes: tuple[str, ...] = ()

    @property
    def distance_m(self) -> float:
        """Length of the whole path."""
        return float(self.rows[-1, 1]) if len(self.rows) else 0.0


def track_default(samples: LegSamples, settings: StrideSettings, heading_rad: float | None = None) -> LegTrack:
    """The method of this project: strides by both gyros of the leg, heading by belt gyro and compass; `heading_rad` at the start, if known."""
    strides, counts = leg_strides(samples, settings)
    angles, notes = fused_heading(samples, strides, heading_rad)
    if not np.isnan(samples.belt).all():
        strides = about_trunk(strides, samples.t_s, angles[:, 0])
    rows = path_rows(samples.t_s, distance_at(samples.t_s, strides), angles[:, 0])
    notes = (*notes, *doubts(strides))
    strides = with_turns(strides, samples.t_s, angles[:, 0])
    return LegTrack(rows, strides, counts, source_of(samples), float(angles[-1, 1]), notes)


def leg_strides(samples: LegSamples, settings: StrideSettings) -> tuple[tuple[Stride, ...], LegCounts]:
    """Strides of one leg, and counts; read a second time with the signs that were found in the end, if they were revised."""
    rates = repair_clipping(samples.t_s, np.column_stack([samples.thigh, samples.shank]))
    legs = StrideEstimator(settings)
    for _ in range(2):
        strides = (*legs.feed(samples.t_s, rates[:, 0], rates[:, 1], samples.belt), *legs.finish())
        if not legs.revised:
            break
        legs = StrideEstimator(settings, legs.swings.sign)
    return strides, legs.counts


def fused_heading(
    samples: LegSamples, strides: tuple[Stride, ...], heading_rad: float | None
) -> tuple[Floats, tuple[str, ...]]:
    """Heading of the trunk and its sd (n, 2), and notes; 0 without belt and compass.

    The first pass estimates the gyro's bias and the compass's deviation by iron; the second pass starts from them.
    """
    if not samples.has_heading:
        return np.zeros((len(samples.t_s), 2)), ()
    sign, notes = belt_sign(samples)
    still = standing(strides, samples.t_s)
    belt = np.where(np.isnan(samples.belt), 0.0, sign * samples.belt)
    first, heading = (Heading(heading_rad=heading_rad, sd_rad=START_SD_RAD) for _ in range(2))
    first.feed(samples.t_s, belt, samples.compass, still)
    _adopt_errors(heading, first)
    angles = heading.feed(samples.t_s, belt, samples.compass, still)
    accepted = heading.read - heading.refused
    read = (f"compass accepted in {accepted} of {heading.read} readings",) if heading.read else ()
    return angles, (*notes, *read)


def doubts(strides: tuple[Stride, ...]) -> tuple[str, ...]:
    """Notes on strides that contradict a walk forward."""
    steps = [s for s in strides if not s.flags & (Flag.STANDING | Flag.GAP)]
    if len(steps) > 2 and sum(Flag.BACKWARD in s.flags for s in steps) > 0.5 * len(steps):
        return ("most steps go backward: are the columns of thigh and shank exchanged?",)
    if steps and sum(bool(s.flags & (Flag.UNSEEN | Flag.BACKWARD)) for s in steps) >= 0.5 * len(steps):
        return ("half or more of this is no walk that one leg can observe: do not trust the distance",)
    return () if steps else ("no step was seen",)


def with_turns(strides: tuple[Stride, ...], t_s: Floats, heading: Floats) -> tuple[Stride, ...]:
    """The strides, with `Flag.TURNING` where the trunk's heading (n,) at `t_s` (n,) turns."""
    flagged = []
    for stride in strides:
        h0, h1 = np.interp([stride.t_start_s, stride.t_end_s], t_s, heading)
        span = stride.t_end_s - stride.t_start_s
        turns = span > SHORTEST_TURN_S and abs(h1 - h0) / span > TURNING_RAD_S
        flagged.append(replace(stride, flags=stride.flags | Flag.TURNING) if turns else stride)
    return tuple(flagged)


def standing(strides: tuple[Stride, ...], t_s: Floats) -> Bools:
    """Whether the wearer stands at each time (n,)."""
    still = np.zeros(len(t_s), np.bool_)
    for stride in strides:
        if Flag.STANDING in stride.flags:
            still |= (t_s > stride.t_start_s + STANDING_MARGIN_S) & (t_s < stride.t_end_s - STANDING_MARGIN_S)
    return still


def belt_sign(samples: LegSamples) -> tuple[float, tuple[str, ...]]:
    """Sign of the belt's gyro by the compass, and a note when it is -1; without a compass a positive rate is a turn to the left.

    The angles of both are compared without their linear trend, which holds the gyro's bias.
    """
    read = np.isfinite(samples.compass)
    if np.isnan(samples.belt).all() or read.sum() < FEWEST_READINGS:
        return 1.0, ()
    turned = np.cumsum(np.nan_to_num(samples.belt) * np.diff(samples.t_s, prepend=samples.t_s[0]))[read]
    compass, t_s = np.unwrap(samples.compass[read]), samples.t_s[read]
    turned, compass = (column - np.polyval(np.polyfit(t_s, column, 1), t_s) for column in (turned, compass))
    if min(np.ptp(turned), np.ptp(compass)) < SIGN_TURN_RAD or (turned * compass).sum() >= 0.0:
        return 1.0, ()
    return -1.0, ("belt gyro worn the other way round, by the compass",)


def source_of(samples: LegSamples) -> str:
    """Sensors of the heading, in words."""
    belt, compass = (not bool(np.isnan(column).all()) for column in (samples.belt, samples.compass))
    if belt and compass:
        return "belt gyro and compass"
    if belt:
        return "belt gyro alone, from 0: its sign is taken for left positive"
    return "compass alone" if compass else "none: a straight line is drawn"


def distance_at(t_s: Floats, strides: tuple[Stride, ...]) -> Floats:
    """Distance (n,) gone at times (n,): it grows evenly within each stride."""
    knots = [(float(t_s[0]), 0.0)]
    distance_m = 0.0
    for stride in strides:
        if stride.t_start_s > knots[-1][0]:
            knots.append((stride.t_start_s, distance_m))
        distance_m += stride.length_m
        knots.append((max(stride.t_end_s, knots[-1][0]), distance_m))
    return np.interp(t_s, *np.array(knots).T)


def path_rows(t_s: Floats, distance: Floats, heading: Floats) -> Floats:
    """Rows of `LegTrack` (n, 6): the position moves along the heading (n,) as the distance (n,) grows."""
    move = np.diff(distance, prepend=0.0)
    speed = np.array([0.0, *(move[1:] / np.diff(t_s))])
    x, y = np.cumsum(move * np.cos(heading)), np.cumsum(move * np.sin(heading))
    return np.column_stack([t_s, distance, speed, np.arctan2(np.sin(heading), np.cos(heading)), x, y])


def _adopt_errors(heading: Heading, known: Heading) -> None:
    """Start with the gyro's bias and the iron that another filter has found in the same record, and with their variances.

    Both hardly change within a record, so that their last estimate rests on all samples.
    """
    heading.state[BIAS:] = known.state[BIAS:]
    heading.P[BIAS:, BIAS:] = np.diag(np.diag(known.P)[BIAS:])


# All assumed.
LENGTH_RANGE_M = (0.2, 0.75)  # thigh or shank: a quarter of a height of 0.8 m, and 0.285 (to the floor) of 2.6 m
CENTIMETRES = (15.0, 80.0)  # a number in this range is a length in centimetres: LENGTH_RANGE_M with a margin
WALKED_RANGE_M = (3.0, 1000.0)  # length of the walk: two strides at least, and what can be measured on the ground
SCALE_RANGE = (0.3, 3.0)  # computed over true length; beyond it another walk or unit is likely: 3.28 feet are a metre


def checked_lengths(thigh_m: float | None, shank_m: float | None, scale: float = 1.0) -> LegLengths:
    """The lengths, when a person can have them, the usual ones for None; raises EchostepError otherwise."""
    thigh_m, shank_m = (USUAL_M if length is None else length for length in (thigh_m, shank_m))
    for name, length in (("--thigh", thigh_m), ("--shank", shank_m)):
        if not LENGTH_RANGE_M[0] <= length <= LENGTH_RANGE_M[1]:
            hint = ": in centimetres? give metres" if CENTIMETRES[0] < length < CENTIMETRES[1] else ""
            raise EchostepError(f"{name} {length:g}: expected {LENGTH_RANGE_M[0]} to {LENGTH_RANGE_M[1]} m{hint}")
    return LegLengths(thigh_m, shank_m, scale)


def calibrated_scale(distance_m: float, walked_m: float) -> float:
    """Factor on all stride lengths: true length `walked_m` of a walk over its computed length; raises EchostepError when they do not fit."""
    if not WALKED_RANGE_M[0] <= walked_m <= WALKED_RANGE_M[1]:
        raise EchostepError(f"--walked {walked_m:g}: expected the walk's length in metres, 3 to 1000, best 10 or more")
    if distance_m < SCALE_RANGE[0] * walked_m or distance_m > SCALE_RANGE[1] * walked_m:
        raise EchostepError(
            f"--walked {walked_m:g}: these samples hold {distance_m:.2f} m: is it the same walk, and are the legs in metres?"
        )
    return walked_m / distance_m


TRACK_COLUMNS = ("t_s", "distance_m", "speed_m_s", "heading_rad", "x", "y")
PARTIAL = Flag.EDGE | Flag.STANDING | Flag.UNSEEN | Flag.BACKWARD | Flag.GAP  # not a whole stride of known length
MOST_LISTED = 40  # strides: a screenful
FLAG_WORDS = {
    Flag.SLOW: "slow", Flag.FAST: "fast", Flag.TURNING: "turning", Flag.STAIRS_UP: "up stairs", Flag.STAIRS_DOWN: "down stairs",
    Flag.UNSEEN: "in place or sideways, not counted", Flag.BACKWARD: "backward, not counted", Flag.GAP: "gaps bridged by pace",
}  # fmt: skip


def write_leg_track(path: Path | str, track: LegTrack) -> None:
    """`TRACK_COLUMNS`, a row a sample (the paper's: ten a second); raises EchostepError when the file cannot be written."""
    with as_error(f"{path}: cannot write the track"):
        write_csv(Path(path), TRACK_COLUMNS, ([f"{v:.6f}" for v in row] for row in track.rows.tolist()))


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
    """A line for each stride: time, length with its standard deviation, speed, kind; of a long walk the first MOST_LISTED."""
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
