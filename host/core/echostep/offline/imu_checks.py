# SPDX-License-Identifier: MIT
"""Checks of the samples of a recorded foot IMU, and of the track computed from them.

In: the table (n, 7 or more) of time s, specific force m/s2 and angular rate rad/s; a `Track`. Out: rows in order; messages with advice: a complaint
when the samples cannot be used, notes when they can with care; how a track contradicts itself. Owns nothing. Without these checks, wrong units or a
dead sensor give a plausible, wrong track.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from echostep.arrays import Bools, Floats, spans
from echostep.errors import EchostepError
from echostep.foot.steps import Track
from echostep.foot.zupt_ins import STEEP_M_S2, STEEP_RAD_S
from echostep.offline.csv_table import rate_complaint
from echostep.xsens.reader import HELD

TIME = 0  # columns of the table
FORCE = slice(1, 4)
RATE = slice(4, 7)
SENSOR_COLUMNS = 7  # time, force and rate; a magnetometer may follow

# Assumed, all of them.
CALMEST_SHARE = 0.1  # share of the samples in which a foot surely stands
# Of the specific force at rest: 30 % for errors of the sensor and a foot not quite at rest
GRAVITY_RANGE_M_S2 = (7.0, 13.0)
G_RANGE = (0.7, 1.3)  # the same in units of gravity
FASTEST_FOOT_RAD_S = 40.0  # 2300 deg/s; common gyros end at 2000 deg/s
FASTEST_QUANTILE = 0.999  # of the rates, compared with that limit: single spikes are left out
RATE_RANGE_HZ = (45.0, 550.0)  # 50 to 500 Hz with a margin of 10 %
REGULAR_SHARE = 0.01  # largest share of sorted times that follow each other within half a period
WRAPS_S = (
    2**32 * 1e-6,
    2**32 * 1e-4,
    2**32 * 1e-3,
    2**16 * 1e-3,
)  # of counters in microseconds, tenths of a millisecond, milliseconds
ROOM = 1.5  # periods between two neighbours, between which there is a place
LATEST = 10.0  # periods, after which two exchanged parts do not follow each other
BACK_SHARE = 0.02  # largest share of rows whose time goes back
REPEATED_SHARE = 0.6  # largest share of rows that repeat the time before
MISSING_SHARE = 0.02  # share of missing samples that is reported
CLIPPED_SHARE = 1e-3  # least share of readings at the limit that is reported
FEWEST_REPEATS = 3  # of equal neighbours at the limit
FEWEST_ROWS = 100  # fewer rows do not show a dead sensor
DEAD_SHARE = 0.5  # share of rows that repeat, from which on a sensor is dead
DEAD_S = 2.0  # longest time without a change while the foot moves
MOVING_RAD_S = 0.5  # rate of a moving foot
MOVING_SHARE = 0.1  # of a stretch without a change in which the foot moves
OF_NO_UNIT = 1e6  # force or rate that no unit of a sample gives
FEWEST_SAMPLES, FIRST = 500, 3000  # of arrays that are checked: 1 to 10 s, 6 to 60 s
SHORTEST_STEP_S = 0.05  # lower bound of a step's duration where its speed is computed
FASTEST_WALK_M_S = 8.0  # median speed of the foot over a step
FORCED_SAMPLES = 5  # samples of rest accepted against the innovation gate
LOST_SHARE = 0.2  # standard deviation of the end over the length of the path
HIGHEST_STEP_M = 1.0  # median rise of a step
GLIDING_SHARE = 0.85  # of rest in a contradictory walk: a foot that glides too slowly for its sensor
NEEDED = "zero-velocity navigation needs a foot that stands in each step"
LEAST_FAULT = 0.1  # excess of the force at rest that may be why a track is no foot's


def whole_rows(table: Floats) -> tuple[Floats, tuple[str, ...]]:
    """The rows measured anew, with a number in each of the first seven columns, and notes on those left out."""
    filled = is_filled(table)
    whole = np.isfinite(table[:, :SENSOR_COLUMNS]).all(axis=1) & ~(filled & (filled.mean() < DEAD_SHARE))
    held = np.zeros(len(table), np.bool_)
    for begin, end in spans((np.diff(table[:, FORCE.start : RATE.stop], axis=0) == 0.0).all(1)).tolist():
        held[begin + 1 : end + 1] = end - begin > HELD
    held &= whole & (held.mean() < DEAD_SHARE)
    found = {"without a number in some column: skipped": ~whole, "repeat the one before them: taken as missing": held}
    return table[whole & ~held], tuple(f"{int(rows.sum())} rows {what}" for what, rows in found.items() if rows.any())


def is_filled(table: Floats) -> Bools:
    """Whether each row (n,) has the same number on all axes of a sensor, as 0 or -9999 in place of a sample."""
    filled: Bools = np.ptp(table[:, FORCE], axis=1) + np.ptp(table[:, RATE], axis=1) == 0.0
    return filled


def unwrapped(t_s: Floats, period_s: float) -> Floats:
    """The times (n,) of samples in such periods, with counters that wrap going on."""
    for wrap_s in WRAPS_S:
        near_s = min(LATEST * period_s, 0.01 * wrap_s)
        t_s = t_s + wrap_s * np.cumsum(np.abs(np.diff(t_s, prepend=t_s[:1]) + wrap_s) < near_s)
    return t_s


def out_of_line(t_s: Floats, period_s: float) -> Bools:
    """Whether each time (n,) is outside of its two neighbours', which have a place for it: a single wrong stamp. The ends have one neighbour."""
    before, at, after = t_s[:-2], t_s[1:-1], t_s[2:]
    return np.concatenate([[False], (after - before > ROOM * period_s) & ((at < before) | (at > after)), [False]])[
        : len(t_s)
    ]


def sorted_by_time(table: Floats) -> tuple[Floats, tuple[str, ...]]:
    """The rows sorted by time, with notes, if that makes the times regular; counters that wrap go on. Raises ValueError for a restarted clock."""
    period_s = float(np.median(np.abs(np.diff(table[:, TIME])))) if len(table) > 1 else 0.0
    table[:, TIME] = unwrapped(table[:, TIME], period_s)
    off = out_of_line(table[:, TIME], period_s)
    table, found = (
        table[~off],
        (f"{int(off.sum())} times are out of line with their neighbours': skipped",) * bool(off.any()),
    )
    t_s = table[:, TIME]
    back = int((np.diff(t_s) < 0.0).sum())
    if not back:
        return table, found
    order = np.argsort(t_s, kind="stable")
    ahead, steps = (each[each > 0.0] for each in (np.diff(t_s), np.diff(t_s[order])))
    apart = back == 1 and len(steps) and t_s[0] - t_s[-1] > LATEST * np.median(steps)
    if len(steps) and back < BACK_SHARE * len(t_s) and (apart or np.median(steps) < 0.75 * np.median(ahead)):
        raise ValueError("t_s begins anew within the file: are these several recordings? Cut it there")
    if len(steps) and float((steps < 0.5 * np.median(steps)).mean()) < REGULAR_SHARE:
        return table[order], (*found, f"{back} rows were not in the order of t_s: sorted by it")
    return table, found


def complaint(table: Floats, columns: Sequence[str]) -> str:
    """Why the samples cannot be used, as a message; empty when they can."""
    return time_complaint(table[:, TIME], "a foot") or _dead_complaint(table, columns) or _unit_complaint(table)


def check_samples(t_s: Floats, accel: Floats, gyro: Floats) -> None:
    """Refuse what a file would be refused for: t_s (n,) s, accel (n, 3) m/s2, gyro (n, 3) rad/s. Less than FEWEST_SAMPLES may have no rest.

    Raises EchostepError with the factor to multiply or divide by.
    """
    if len(t_s) < FEWEST_SAMPLES or np.shape(accel) != (len(t_s), 3) or np.shape(gyro) != (len(t_s), 3):
        return
    rows = np.column_stack([t_s, accel, gyro])[:FIRST]
    rows = rows[np.isfinite(rows[:, TIME]) & (np.abs(rows[:, FORCE.start :]) < OF_NO_UNIT).all(axis=1)]
    if len(rows) and (wrong := time_complaint(rows[:, TIME], "a foot") or _unit_complaint(rows)):
        raise EchostepError(f"samples: {wrong}")


def time_complaint(t_s: Floats, what: str) -> str:
    """Message for the times (n,) of `what` that go back, repeat, or have another unit."""
    steps = np.diff(t_s)
    back = float((steps < 0).mean()) if len(steps) else 0.0
    if back > BACK_SHARE:
        return f"t_s goes back in {100 * back:.0f} % of the rows, even when sorted: are several recordings mixed?"
    forward = steps[steps > 0]
    if not len(forward):
        return "t_s does not advance"
    if (steps == 0.0).mean() > REPEATED_SHARE:
        return f"t_s repeats itself in {100 * (steps == 0.0).mean():.0f} % of the rows: are several recordings mixed?"
    rate = 1.0 / float(np.median(forward))
    return rate_complaint(rate, RATE_RANGE_HZ, f"{what} needs 50 at least", "average them down to 500 or fewer")


def _dead_complaint(table: Floats, columns: Sequence[str]) -> str:
    """Message for a column that never changes, or else for the one that stays unchanged longest while the foot moves."""
    longest, dead = DEAD_S, ""
    for k, name in enumerate(columns[1:SENSOR_COLUMNS], start=1):
        if len(table) > FEWEST_ROWS and np.ptp(table[:, k]) == 0.0:
            return f"{name} is constant: is that sensor alive?"
        others = [column for column in range(RATE.start, RATE.stop) if column != k]
        moving = np.linalg.norm(table[:, others], axis=1) > MOVING_RAD_S
        for begin, end in spans(np.diff(table[:, k]) == 0.0).tolist():
            span = float(table[end, TIME] - table[begin, TIME])
            if span > longest and moving[begin:end].mean() > MOVING_SHARE:
                longest, since = span, float(table[begin, TIME])
                dead = f"{name} does not change for {span:.1f} s from {since:.2f} s on, while the foot moves: is that sensor alive?"
    return dead


def _unit_complaint(table: Floats) -> str:
    """Message for forces in g or without gravity, and for rates in deg/s."""
    rate = np.linalg.norm(table[:, RATE], axis=1)
    calm = rate <= np.quantile(rate, CALMEST_SHARE)  # over all samples of a run the median is far above gravity
    force = float(np.median(np.linalg.norm(table[calm, FORCE], axis=1)))
    if G_RANGE[0] <= force <= G_RANGE[1]:
        return f"ax, ay, az look like g (at rest they are {force:.2f}): multiply them by 9.80665, or say --units g"
    if not GRAVITY_RANGE_M_S2[0] <= force <= GRAVITY_RANGE_M_S2[1]:
        return f"ax, ay, az are {force:.3g} at rest, gravity is 9.8 m/s2: wrong unit, or gravity was removed"
    fastest = float(np.quantile(np.abs(table[:, RATE]), FASTEST_QUANTILE))
    if fastest > FASTEST_FOOT_RAD_S:
        return f"gx, gy, gz reach {fastest:.0f}, no foot turns so fast in rad/s: in deg/s? multiply them by pi/180, or say --units deg/s"
    return ""


def notes(table: Floats, columns: Sequence[str]) -> tuple[str, ...]:
    """Faults of the samples that make the track less certain, a line each."""
    remarks = []
    steps = np.diff(table[:, TIME])
    if repeated := int((steps == 0.0).sum()):
        remarks.append(f"{repeated} rows repeat the time before them: skipped")
    if back := int((steps < 0.0).sum()):
        remarks.append(f"t_s goes back {back} times: was the clock set?")
    if (missing := missing_share(steps)) > MISSING_SHARE:
        remarks.append(f"{100 * missing:.0f} % of the samples are missing: the track is less certain")
    for k, name in enumerate(columns[1:SENSOR_COLUMNS], start=1):
        if clipped := _clipped(table[:, k], STEEP_M_S2 if k < RATE.start else STEEP_RAD_S):
            limit, share = clipped
            remarks.append(
                f"{name} is cut off at {limit:.4g} in {100 * share:.1f} % of the rows: the sensor's range is too small, the track is less certain"
            )
    return tuple(remarks)


def missing_share(steps: Floats) -> float:
    """Share of missing samples, from the differences of time (n,): one less the ratio of samples to median periods."""
    forward = steps[steps > 0.0]
    return 1.0 - len(forward) * float(np.median(forward)) / float(forward.sum())


def _clipped(column: Floats, steep: float) -> tuple[float, float] | None:
    """The extreme value that a column (n,) repeats, and its share of the rows; None if it repeats no value beyond `steep`."""
    for limit in (float(column.max()), float(column.min())):
        cut = column == limit
        if abs(limit) > steep and (cut[1:] & cut[:-1]).sum() >= FEWEST_REPEATS and cut.mean() > CLIPPED_SHARE:
            return limit, float((np.abs(column) >= abs(limit)).mean())
    return None


def contradiction(track: Track) -> str:
    """How a track contradicts the motion of a foot, as a message with the likely cause; empty when it does not."""
    steps, counts, wrong = track.steps, track.counts, ""
    speeds = [np.hypot(*s.move_m[:2]) / max(s.t_end_s - s.t_start_s, SHORTEST_STEP_S) for s in steps]
    if not track.stance.any():
        return f"the foot was never still in these samples: {NEEDED}"
    if speeds and float(np.median(speeds)) > FASTEST_WALK_M_S:
        wrong = f"half of the steps are faster than {np.median(speeds):.0f} m/s"
    elif steps and float(np.median([abs(s.move_m[2]) for s in steps])) > HIGHEST_STEP_M:
        wrong = "half of the steps rise or fall by more than a metre"
    elif counts.forced > FORCED_SAMPLES and end_sd_m(track) > LOST_SHARE * sum(np.hypot(*s.move_m[:2]) for s in steps):
        wrong = "the foot is at rest where its computed motion excludes it"
    if not wrong:
        return ""
    if LEAST_FAULT < abs(steps[0].excess) < 1.0:
        return f"{wrong}: {steps[0].doubts()[-1]}"
    if (share := float(track.stance[np.searchsorted(track.t_s, steps[0].t_start_s) :].mean())) > GLIDING_SHARE:
        return f"the foot was never still: it seems to stand in {100 * share:.0f} % of the walk, against its motion: {NEEDED}"
    return f"{wrong}: is the sensor on the foot, are the units m/s2 and rad/s, and the axes right-handed?"


def end_sd_m(track: Track) -> float:
    """Standard deviation (m) of the horizontal position error at the end, from the steps' covariances and the growth of the yaw's error.

    A yaw error at a step turns the path after it about that step; an error of the scale stretches it whole.
    """
    steps = track.steps
    if not steps:
        return 0.0
    positions = np.cumsum([step.move_m[:2] for step in steps], axis=0)
    own = sum(float(step.covariance[0, 0] + step.covariance[1, 1]) for step in steps)
    turns = np.array([step.heading_sd_rad for step in steps])
    shared = (steps[-1].scale_sd * float(np.hypot(*positions[-1]))) ** 2
    return math.sqrt(own + shared + float(turns**2 @ ((positions[-1] - positions) ** 2).sum(axis=1)))
