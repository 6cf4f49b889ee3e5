"""A recorded leg as a CSV file: read with suspicion, tracked by the same code as live.

In: columns `t_s,thigh_rad_s,shank_rad_s[,belt_rad_s,compass_rad]`, 50 to 500 Hz, either sign. Out: `LegSamples` with what had to be mended, or an
EchostepError that says what is wrong; `LegTrack`, as CSV and in words. Owns nothing.
"""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TextIO

import numpy as np

from echostep.arrays import Bools, Floats
from echostep.errors import EchostepError
from echostep.legs import swing_detection as leg_swings
from echostep.legs.clipping import find_clipping_limits, repair_clipping
from echostep.legs.heading import Heading
from echostep.legs.kinematics import LegLengths
from echostep.legs.stride import Flag, LegCounts, Stride, StrideSettings, distance_sd_m
from echostep.legs.strides import StrideEstimator
from echostep.offline.csv_table import LONGEST_LINE, CsvLimits, header_of, lines_of, open_samples, read_rows
from echostep.offline.imu_checks import RATE_RANGE_HZ, sorted_by_time
from echostep.papers import lee2010

COLUMNS = ("t_s", "thigh_rad_s", "shank_rad_s")
OPTIONAL = ("belt_rad_s", "compass_rad")
TRACK_COLUMNS = ("t_s", "distance_m", "speed_m_s", "heading_rad", "x", "y")
FASTEST_LEG_RAD_S = 20.0  # of one sample in a hundred; a sprinter's shank reaches it
MOST_TURNS = 4  # of a compass that was not wrapped
MOST_BACK, FEW = 0.02, 100
SEGMENT_RANGE_M = (0.2, 0.75)
START_SD_RAD = math.radians(3.0)  # of a heading that somebody knows
SIGN_TURN_RAD = math.radians(30.0)


@dataclass(frozen=True, slots=True)
class LegSamples:
    """Arrays (n,): `t_s`, `thigh`, `shank`, `belt` rad/s, `compass` rad; NaN where the file has no belt or compass. `notes`: what was mended."""

    t_s: Floats
    thigh: Floats
    shank: Floats
    belt: Floats
    compass: Floats
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class LegTrack:
    """`rows` (n, 6) of `TRACK_COLUMNS`; `strides` (none by the paper's method); `source` of the heading in words; its sd at the end."""

    rows: Floats
    strides: tuple[Stride, ...]
    counts: LegCounts | None
    source: str
    heading_sd_rad: float
    notes: tuple[str, ...] = ()


def segments(thigh_m: float, shank_m: float, scale: float = 1.0) -> LegLengths:
    """Lengths that a person can have; raises EchostepError."""
    for name, length in (("--thigh", thigh_m), ("--shank", shank_m)):
        if not SEGMENT_RANGE_M[0] <= length <= SEGMENT_RANGE_M[1]:
            hint = ": in centimetres? give metres" if 15.0 < length < 80.0 else ""
            raise EchostepError(
                f"{name} {length:g}: no such leg, expected {SEGMENT_RANGE_M[0]} to {SEGMENT_RANGE_M[1]} m{hint}"
            )
    return LegLengths(thigh_m, shank_m, scale)


def load_legs(path: Path | str) -> LegSamples:
    """Samples of a CSV file; raises EchostepError that names the file and what is wrong with which column."""
    table, mended = open_samples(path, _mended_table)
    later = np.concatenate([[True], table[1:, 0] > np.maximum.accumulate(table[:-1, 0])])
    t_s, thigh, shank, belt, compass = table[later].T
    return LegSamples(t_s, thigh, shank, belt, compass, (*mended, *_notes(table)))


def _mended_table(file: TextIO) -> tuple[Floats, tuple[str, ...]]:
    """Usable rows (n, 5) in order of time, and notes on what was mended; raises ValueError for samples that cannot be used."""
    table = _table(file)
    whole = np.isfinite(table[:, :3]).all(axis=1)
    holes = () if whole.all() else (f"{int((~whole).sum())} rows without a number in some column: skipped",)
    table, mended = sorted_by_time(table[whole])
    if wrong := complaint(table):
        raise ValueError(wrong)
    return table, (*holes, *mended)


def _table(file: TextIO) -> Floats:
    """The columns (n, 5), NaN where the file has none or no number."""
    header, separator = header_of(file.readline(LONGEST_LINE))
    if missing := [name for name in COLUMNS if name not in header]:
        raise ValueError(
            f"no column {', '.join(missing)}; the first line must name {','.join(COLUMNS)}[,{','.join(OPTIONAL)}]{_unit_hint(header)}"
        )
    columns = [header.index(name) if name in header else -1 for name in COLUMNS + OPTIONAL]
    return read_rows(lines_of(file, CsvLimits(), first=2), separator, columns, len(COLUMNS), CsvLimits()).values


def _unit_hint(header: list[str]) -> str:
    degrees = [name for name in header if "deg" in name.lower()]
    return f"; {degrees[0]} looks like degrees: multiply by pi/180 and name it rad" if degrees else ""


def complaint(table: Floats) -> str:
    """What makes the samples (n, 5) unusable, in words; empty when nothing does."""
    return _time_complaint(table[:, 0]) or _dead_complaint(table) or _unit_complaint(table)


def _time_complaint(t_s: Floats) -> str:
    steps = np.diff(t_s)
    forward = steps[steps > 0.0]
    if not len(forward):
        return "t_s does not advance"
    if (back := float((steps < 0.0).mean())) > MOST_BACK:
        return (
            f"t_s goes back in {100 * back:.0f} % of the rows, and sorting does not help: are several recordings mixed?"
        )
    rate = 1.0 / float(np.median(forward))
    return "" if RATE_RANGE_HZ[0] <= rate <= RATE_RANGE_HZ[1] else _rate_complaint(rate)


def _dead_complaint(table: Floats) -> str:
    if len(table) <= FEW:
        return ""
    for k, name in ((1, COLUMNS[1]), (2, COLUMNS[2])):
        if np.ptp(table[:, k]) == 0.0:
            return f"{name} is constant: is that sensor alive?"
    if np.array_equal(table[:, 1], table[:, 2]):
        return "thigh_rad_s and shank_rad_s are the same numbers: is one column copied?"
    return ""


def _rate_complaint(rate: float) -> str:
    for unit, factor in (("milliseconds", 1e3), ("microseconds", 1e6), ("nanoseconds", 1e9)):
        if RATE_RANGE_HZ[0] <= rate * factor <= RATE_RANGE_HZ[1]:
            return f"t_s gives {rate:.3g} samples a second: is it in {unit}? divide it by {factor:.0f} to have seconds"
    advice = "a leg needs 50 at least" if rate < RATE_RANGE_HZ[0] else "average them down to 500 or fewer"
    return f"t_s gives {rate:.3g} samples a second: is it in seconds? {advice}"


def _unit_complaint(table: Floats) -> str:
    """Degrees or turns in the place of radians: no leg turns so far."""
    for k, name in ((1, COLUMNS[1]), (2, COLUMNS[2]), (3, OPTIONAL[0])):
        column = table[np.isfinite(table[:, k]), k]
        if len(column) and float(np.quantile(np.abs(column), 0.99)) > FASTEST_LEG_RAD_S:
            fastest = float(np.abs(column).max())
            return f"{name} reaches {fastest:.0f}, no leg turns so fast in rad/s: in deg/s? multiply it by pi/180"
    compass = np.abs(table[np.isfinite(table[:, 4]), 4])
    if len(compass) and float(compass.max()) > MOST_TURNS * 2.0 * math.pi:
        return f"compass_rad reaches {float(compass.max()):.0f}: in degrees? multiply it by pi/180"
    return ""


def _notes(table: Floats) -> tuple[str, ...]:
    found = []
    steps = np.diff(table[:, 0])
    if repeated := int((steps <= 0.0).sum()):
        found.append(f"{repeated} rows are not later than the one before: skipped")
    forward = steps[steps > 0.0]
    missing = 1.0 - len(forward) * float(np.median(forward)) / float(forward.sum())
    if missing > 0.02:
        found.append(f"{100 * missing:.0f} % of the samples are missing: the track is less certain")
    for name, *ends in zip(COLUMNS[1:], *find_clipping_limits(table[:, 1:3]), strict=True):
        if reached := [abs(end) for end in ends if math.isfinite(end)]:
            found.append(
                f"{name} is cut off at {min(reached):.3g} rad/s, the sensor's range is too small: tops are drawn in"
            )
    return tuple(found)


def track_default(samples: LegSamples, settings: StrideSettings, heading_rad: float | None = None) -> LegTrack:
    """Ours: strides by both segments, heading by gyro and compass; `heading_rad` at the beginning, when it is known."""
    legs = StrideEstimator(settings)
    thigh, shank = repair_clipping(samples.t_s, np.column_stack([samples.thigh, samples.shank])).T
    strides = (*legs.feed(samples.t_s, thigh, shank), *legs.finish())
    sign, how = belt_sign(samples)
    heading = Heading(heading_rad=heading_rad, sd_rad=START_SD_RAD)
    still = standing(strides, samples.t_s)
    angles = heading.feed(
        samples.t_s, np.where(np.isnan(samples.belt), 0.0, sign * samples.belt), samples.compass, still
    )
    if np.isnan(samples.belt).all() and np.isnan(samples.compass).all():
        angles = np.zeros_like(angles)
    rows = _rows(samples.t_s, strides, angles[:, 0])
    seen = (f"compass believed in {heading.read - heading.refused} of {heading.read} readings",) if heading.read else ()
    notes = (*how, *seen, *_doubts(strides))
    strides = with_turns(strides, samples.t_s, angles[:, 0])
    return LegTrack(rows, strides, legs.counts, _source(samples), float(angles[-1, 1]), notes)


def _doubts(strides: tuple[Stride, ...]) -> tuple[str, ...]:
    """What speaks against these samples being a walk."""
    steps = [s for s in strides if not s.flags & (Flag.STANDING | Flag.GAP)]
    if len(steps) > 2 and sum(Flag.BACKWARD in s.flags for s in steps) > 0.5 * len(steps):
        return ("most steps go backward: are the columns of thigh and shank exchanged?",)
    if len(steps) > 2 and sum(bool(s.flags & (Flag.UNSEEN | Flag.BACKWARD)) for s in steps) > 0.5 * len(steps):
        return ("most of this is no walk that one leg can see: do not trust the distance",)
    return () if steps else ("no step was seen",)


def with_turns(strides: tuple[Stride, ...], t_s: Floats, heading: Floats) -> tuple[Stride, ...]:
    """The strides, those flagged in which the trunk turned."""
    found = []
    for stride in strides:
        h0, h1 = np.interp([stride.t_start_s, stride.t_end_s], t_s, heading)
        span = stride.t_end_s - stride.t_start_s
        turns = span > 0.3 and abs(h1 - h0) / span > TURNING_RAD_S
        found.append(replace(stride, flags=stride.flags | Flag.TURNING) if turns else stride)
    return tuple(found)


TURNING_RAD_S = math.radians(25.0)


def track_lee2010(samples: LegSamples, settings: StrideSettings) -> LegTrack:
    """The paper's: 10 Hz, each sign found as ours is."""
    rates = np.column_stack([samples.thigh, samples.shank])
    swings = leg_swings.Swings()
    watched_s = np.cumsum(np.minimum(np.diff(samples.t_s, prepend=samples.t_s[0]), lee2010.LONGEST_GAP_S))
    grid = np.arange(0.0, watched_s[-1], 1.0 / leg_swings.GRID_HZ)
    even = np.column_stack([np.interp(grid, watched_s, column) for column in rates.T])
    thigh, shank = swings.sign if swings.decide(even, final=True) else (1.0, 1.0)
    sign, how = belt_sign(samples)
    lee = lee2010.LeeSettings(legs=lee2010.Lee2010Legs(settings.segments.thigh_m, settings.segments.shank_m))
    walker = lee2010.Walker(lee)
    if np.isnan(samples.compass).all():
        walker.heading = lee2010.Fused(0.0, 0.0)
    belt = np.where(np.isnan(samples.belt), 0.0, sign * samples.belt)
    rows = walker.feed(samples.t_s, thigh * samples.thigh, shank * samples.shank, belt, samples.compass)
    return LegTrack(rows, (), None, _source(samples), math.sqrt(walker.heading.variance), how)


PROFILES = {"default": track_default, "lee2010": track_lee2010}


def standing(strides: tuple[Stride, ...], t_s: Floats) -> Bools:
    """Whether the wearer stood at each time."""
    found = np.zeros(len(t_s), np.bool_)
    for stride in strides:
        if Flag.STANDING in stride.flags:
            found |= (t_s > stride.t_start_s + 0.2) & (t_s < stride.t_end_s - 0.2)
    return found


def belt_sign(samples: LegSamples) -> tuple[float, tuple[str, ...]]:
    """Which way round the belt's gyro is worn, by the compass; without one, positive is taken for a turn to the left."""
    read = np.isfinite(samples.compass)
    if np.isnan(samples.belt).all() or read.sum() < 20:
        return 1.0, ()
    turned = np.cumsum(np.nan_to_num(samples.belt) * np.diff(samples.t_s, prepend=samples.t_s[0]))[read]
    shown, at = np.unwrap(samples.compass[read]), samples.t_s[read]
    turned, shown = (column - np.polyval(np.polyfit(at, column, 1), at) for column in (turned, shown))
    if min(np.ptp(turned), np.ptp(shown)) < SIGN_TURN_RAD or (turned * shown).sum() >= 0.0:
        return 1.0, ()
    return -1.0, ("belt gyro worn the other way round, by the compass",)


def _source(samples: LegSamples) -> str:
    belt, compass = (not bool(np.isnan(column).all()) for column in (samples.belt, samples.compass))
    if belt and compass:
        return "belt gyro and compass"
    if belt:
        return "belt gyro alone, from 0: its sign is taken for left positive"
    return "compass alone" if compass else "none: a straight line is drawn"


def _rows(t_s: Floats, strides: tuple[Stride, ...], heading: Floats) -> Floats:
    """Distance goes evenly through each stride, the place goes along the heading."""
    knots = [(float(t_s[0]), 0.0)]
    way = 0.0
    for stride in strides:
        if stride.t_start_s > knots[-1][0]:
            knots.append((stride.t_start_s, way))
        way += stride.length_m
        knots.append((max(stride.t_end_s, knots[-1][0]), way))
    distance = np.interp(t_s, *np.array(knots).T)
    move = np.diff(distance, prepend=0.0)
    speed = np.array([0.0, *(move[1:] / np.diff(t_s))])
    x, y = np.cumsum(move * np.cos(heading)), np.cumsum(move * np.sin(heading))
    return np.column_stack([t_s, distance, speed, np.arctan2(np.sin(heading), np.cos(heading)), x, y])


def write_leg_track(path: Path | str, track: LegTrack) -> None:
    """`TRACK_COLUMNS`, a row a sample (the paper's: ten a second); raises EchostepError when the file cannot be written."""
    try:
        with Path(path).open("w", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(TRACK_COLUMNS)
            writer.writerows([f"{v:.6f}" for v in row] for row in track.rows.tolist())
    except OSError as error:
        raise EchostepError(f"{path}: cannot write the track: {error.strerror}") from error


def calibrated_scale(distance_m: float, walked_m: float) -> float:
    """What the wearer's legs are to be multiplied by, from a walk of known length; raises EchostepError when that cannot be."""
    if not 3.0 <= walked_m <= 1000.0:
        raise EchostepError(
            f"--walked {walked_m:g}: expected the length of the walk in metres, 3 to 1000, best 10 or more"
        )
    if distance_m < 0.3 * walked_m or distance_m > 3.0 * walked_m:
        raise EchostepError(
            f"--walked {walked_m:g}: these samples hold {distance_m:.2f} m: is it the same walk, and are the legs in metres?"
        )
    return walked_m / distance_m


def describe_legs(track: LegTrack) -> str:
    """Distance with its uncertainty, strides, speed, heading and flags in words."""
    distance = float(track.rows[-1, 1]) if len(track.rows) else 0.0
    if track.counts is None:
        return f"{distance:.2f} m by [Lee 2010]; heading: {track.source}"
    whole = [
        s for s in track.strides if not s.flags & (Flag.EDGE | Flag.STANDING | Flag.UNSEEN | Flag.BACKWARD | Flag.GAP)
    ]
    moving_s = sum(s.t_end_s - s.t_start_s for s in track.strides if s.length_m > 0.0)
    speed = distance / moving_s if moving_s > 0.0 else 0.0
    flags = [f"{n} {word}" for flag, word in WORDS.items() if (n := sum(flag in s.flags for s in track.strides))]
    lost = track.counts.impossible + track.counts.not_later
    return (
        f"{distance:.2f} m, known to {distance_sd_m(track.strides):.2f} m (1 sd); {len(whole)} whole strides, {speed:.2f} m/s while walking; "
        f"heading: {track.source}; {track.counts.samples} samples, {lost} skipped, {track.counts.gaps} gaps"
        + "".join(f"; {flag}" for flag in flags)
        + "".join(f"; {note}" for note in track.notes)
    )


WORDS = {
    Flag.SLOW: "slow", Flag.FAST: "fast", Flag.TURNING: "turning", Flag.STAIRS_UP: "up stairs", Flag.STAIRS_DOWN: "down stairs",
    Flag.UNSEEN: "in place or sideways, not counted", Flag.BACKWARD: "backward, not counted", Flag.GAP: "gaps bridged by pace",
}  # fmt: skip
