# SPDX-License-Identifier: MIT
"""Checks of the samples of a recorded foot IMU, and of the track computed from them.

In: the table (n, 7 or more) of time s, specific force m/s2 and angular rate rad/s; a `Track`. Out: rows in order; messages with advice: a complaint
when the samples cannot be used, notes when they can with care; how a track contradicts itself. Owns nothing. Without these checks, a dead sensor
gives a plausible, wrong track. Units and order: `ports.imu_samples`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from echostep.arrays import Bools, Floats, spans
from echostep.foot.steps import Track
from echostep.foot.zupt_ins import STEEP_M_S2, STEEP_RAD_S
from echostep.ports.imu_samples import BACK_SHARE, FORCE, RATE, TIME, time_complaint, unit_complaint
from echostep.xsens.reader import HELD

SENSOR_COLUMNS = 7  # time, force and rate; a magnetometer may follow

# Assumed, all of them.
REGULAR_SHARE = 0.01  # largest share of sorted times that follow each other within half a period
# Of counters in microseconds, tenths of a millisecond, milliseconds; of the time of day
WRAPS_S = 2**32 * 1e-6, 2**32 * 1e-4, 2**32 * 1e-3, 2**16 * 1e-3, 86_400.0
ROOM = 1.5  # periods between two neighbours, between which there is a place
LATEST = 10.0  # periods, after which two exchanged parts do not follow each other
MISSING_SHARE = 0.02  # share of missing samples that is reported
CLIPPED_SHARE = 1e-3  # least share of readings at the limit that is reported
FEWEST_REPEATS = 3  # of equal neighbours at the limit
FEWEST_ROWS = 100  # fewer rows do not show a dead sensor
DEAD_SHARE = 0.5  # share of rows that repeat, from which on a sensor is dead
DEAD_S = 2.0  # longest time without a change while the foot moves
MOVING_RAD_S = 0.5  # rate of a moving foot
MOVING_SHARE = 0.1  # of a stretch without a change in which the foot moves
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
    """The times (n,) of samples in such periods, with counters and days that wrap going on."""
    for wrap_s in WRAPS_S:
        near_s = min(LATEST * period_s, 0.01 * wrap_s)
        t_s = t_s + wrap_s * np.cumsum(np.abs(np.diff(t_s, prepend=t_s[:1]) + wrap_s) < near_s)
    return t_s


def out_of_line(t_s: Floats, period_s: float) -> Bools:
    """Whether each time (n,) is outside of its two neighbours', which have a place for it: a single wrong stamp. The ends have one neighbour."""
    before, at, after = t_s[:-2], t_s[1:-1], t_s[2:]
    off = (after - before > ROOM * period_s) & ((at < before) | (at > after))
    return np.concatenate([[False], off, [False]])[: len(t_s)]


def sorted_by_time(table: Floats) -> tuple[Floats, tuple[str, ...]]:
    """The rows sorted by time, with notes, if that makes the times regular; counters that wrap go on. Raises ValueError for a restarted clock."""
    period_s = float(np.median(np.abs(np.diff(table[:, TIME])))) if len(table) > 1 else 0.0
    table[:, TIME] = unwrapped(table[:, TIME], period_s)
    off = out_of_line(table[:, TIME], period_s)
    found = (f"{int(off.sum())} times are out of line with their neighbours': skipped",) if off.any() else ()
    table = table[~off]
    t_s = table[:, TIME]
    back = int((np.diff(t_s) < 0.0).sum())
    if not back:
        return table, found
    order = np.argsort(t_s, kind="stable")
    ahead, steps = (each[each > 0.0] for each in (np.diff(t_s), np.diff(t_s[order])))
    apart = back == 1 and len(steps) and t_s[0] - t_s[-1] > LATEST * np.median(steps)
    met = len(ahead) - len(steps) + back > BACK_SHARE * len(t_s)  # at equal times: both parts count from 0
    if len(steps) and back < BACK_SHARE * len(t_s) and (apart or met or np.median(steps) < 0.75 * np.median(ahead)):
        raise ValueError("t_s begins anew within the file: are these several recordings? Cut it there")
    if len(steps) and float((steps < 0.5 * np.median(steps)).mean()) < REGULAR_SHARE:
        return table[order], (*found, f"{back} rows were not in the order of t_s: sorted by it")
    return table, found


def complaint(table: Floats, columns: Sequence[str]) -> str:
    """Why the samples cannot be used, as a message; empty when they can."""
    return time_complaint(table[:, TIME], "a foot") or _dead_complaint(table, columns) or unit_complaint(table)


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
