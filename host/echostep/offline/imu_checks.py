"""What is wrong with the samples of a recorded foot IMU, or with the track that came of them: said in words, with what to do.

In: the table (n, 7 or more) of time s, specific force m/s2 and angular rate rad/s; a `Track`. Out: complaints (the samples cannot be
used), notes (they can, with care). Owns nothing. A track from wrong units or a dead sensor would look right and be wrong.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from echostep.arrays import Bools, Floats
from echostep.foot.steps import Track

CALMEST_SHARE = 0.1  # of the samples: a foot that stands
GRAVITY_RANGE_M_S2 = (7.0, 13.0)
G_RANGE = (0.7, 1.3)
FASTEST_FOOT_RAD_S = 40.0  # 2300 deg/s
RATE_RANGE_HZ = (45.0, 550.0)
REGULAR_SHARE = 0.01  # of the sorted times may follow each other too closely
BACK_SHARE, REPEATED_SHARE = 0.02, 0.6
STEEP = (15.0, 4.0)  # m/s2, rad/s: equal readings beyond are a sensor at its limit
CLIPPED_SHARE = 1e-3
DEAD_S = 2.0
MOVING_RAD_S = 0.5
FASTEST_WALK_M_S = 8.0
FORCED_SAMPLES, LOST_SHARE = 5, 0.2  # rests against belief, and what that leaves unknown of the way
HIGHEST_STEP_M = 1.0


def whole_rows(table: Floats) -> tuple[Floats, tuple[str, ...]]:
    """The rows with a number in each of the first seven columns."""
    whole = np.isfinite(table[:, :7]).all(axis=1)
    if whole.all():
        return table, ()
    return table[whole], (f"{int((~whole).sum())} rows without a number in some column: skipped",)


def sorted_by_time(table: Floats) -> tuple[Floats, tuple[str, ...]]:
    """The rows in order of their times, when that makes them regular: shuffled rows are mended, a clock that was set back is not."""
    t_s = table[:, 0]
    back = int((np.diff(t_s) < 0.0).sum())
    if back == 0:
        return table, ()
    order = np.argsort(t_s, kind="stable")
    steps = np.diff(t_s[order])
    steps = steps[steps > 0.0]
    if len(steps) and float((steps < 0.5 * np.median(steps)).mean()) < REGULAR_SHARE:
        return table[order], (f"{back} rows were not in the order of t_s: sorted by it",)
    return table, ()


def complaint(table: Floats, columns: Sequence[str]) -> str:
    """What makes the samples unusable, in words; empty when nothing does."""
    return _time_complaint(table[:, 0]) or _dead_complaint(table, columns) or _unit_complaint(table)


def _time_complaint(t_s: Floats) -> str:
    steps = np.diff(t_s)
    back = float((steps < 0).mean()) if len(steps) else 0.0
    if back > BACK_SHARE:
        return (
            f"t_s goes back in {100 * back:.0f} % of the rows, and sorting does not help: are several recordings mixed?"
        )
    forward = steps[steps > 0]
    if not len(forward):
        return "t_s does not advance"
    if (steps == 0.0).mean() > REPEATED_SHARE:
        return f"t_s repeats itself in {100 * (steps == 0.0).mean():.0f} % of the rows: are several recordings mixed?"
    rate = 1.0 / float(np.median(forward))
    if RATE_RANGE_HZ[0] <= rate <= RATE_RANGE_HZ[1]:
        return ""
    for unit, factor in (("milliseconds", 1e3), ("microseconds", 1e6), ("nanoseconds", 1e9)):
        if RATE_RANGE_HZ[0] <= rate * factor <= RATE_RANGE_HZ[1]:
            return f"t_s gives {rate:.3g} samples a second: is it in {unit}? divide it by {factor:.0f} to have seconds"
    advice = "a foot needs 50 at least" if rate < RATE_RANGE_HZ[0] else "average them down to 500 or fewer"
    return f"t_s gives {rate:.3g} samples a second: is it in seconds? {advice}"


def _dead_complaint(table: Floats, columns: Sequence[str]) -> str:
    """A column that never changes, or that stops changing while the foot moves."""
    longest, dead = DEAD_S, ""
    for k, name in enumerate(columns[1:7], start=1):
        if len(table) > 100 and np.ptp(table[:, k]) == 0.0:
            return f"{name} is constant: is that sensor alive?"
        others = [at for at in (4, 5, 6) if at != k]
        moving = np.linalg.norm(table[:, others], axis=1) > MOVING_RAD_S
        for begin, end in _runs(np.diff(table[:, k]) == 0.0):
            span = float(table[end, 0] - table[begin, 0])
            if span > longest and moving[begin:end].mean() > 0.1:
                longest, since = span, float(table[begin, 0])
                dead = f"{name} does not change for {span:.1f} s from {since:.2f} s on, while the foot moves: is that sensor alive?"
    return dead


def _runs(same: Bools) -> list[tuple[int, int]]:
    """Begin and end of each stretch of true."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], same.astype(np.int8), [0]])))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def _unit_complaint(table: Floats) -> str:
    force = _resting_force(table)
    if G_RANGE[0] <= force <= G_RANGE[1]:
        return f"ax, ay, az look like g (at rest they are {force:.2f}): multiply them by 9.80665"
    if not GRAVITY_RANGE_M_S2[0] <= force <= GRAVITY_RANGE_M_S2[1]:
        return f"ax, ay, az are {force:.3g} at rest, gravity is 9.8 m/s2: wrong unit, or gravity was removed"
    fastest = float(np.quantile(np.abs(table[:, 4:7]), 0.999))
    if fastest > FASTEST_FOOT_RAD_S:
        return f"gx, gy, gz reach {fastest:.0f}, no foot turns so fast in rad/s: in deg/s? multiply them by pi/180"
    return ""


def _resting_force(table: Floats) -> float:
    """Specific force while the foot turns least: a runner's median is far above gravity."""
    rate = np.linalg.norm(table[:, 4:7], axis=1)
    calm = rate <= np.quantile(rate, CALMEST_SHARE)
    return float(np.median(np.linalg.norm(table[calm, 1:4], axis=1)))


def notes(table: Floats, columns: Sequence[str]) -> tuple[str, ...]:
    """What a reader of the track should know of the samples."""
    found = []
    t_s = table[:, 0]
    steps = np.diff(t_s)
    if repeated := int((steps == 0.0).sum()):
        found.append(f"{repeated} rows repeat the time before them: skipped")
    if back := int((steps < 0.0).sum()):
        found.append(f"t_s goes back {back} times: was the clock set?")
    forward = steps[steps > 0.0]
    missing = 1.0 - len(forward) * float(np.median(forward)) / float(forward.sum())
    if missing > 0.02:
        found.append(f"{100 * missing:.0f} % of the samples are missing: the track is less certain")
    for k, name in enumerate(columns[1:7], start=1):
        if clipped := _clipped(table[:, k], STEEP[0] if k < 4 else STEEP[1]):
            limit, share = clipped
            found.append(
                f"{name} is cut off at {limit:.4g} in {100 * share:.1f} % of the rows: the sensor's range is too small, the track is less certain"
            )
    return tuple(found)


def _clipped(column: Floats, steep: float) -> tuple[float, float] | None:
    """The limit that this column reads again and again, and in which share of the rows."""
    for limit in (float(column.max()), float(column.min())):
        at = column == limit
        again = at[1:] & at[:-1]
        if abs(limit) > steep and again.sum() >= 3 and at.mean() > CLIPPED_SHARE:
            return limit, float((np.abs(column) >= abs(limit)).mean())
    return None


def contradiction(track: Track) -> str:
    """How a track contradicts what feet do, in words; empty when it does not."""
    steps, counts = track.steps, track.counts
    if not track.stance.any():
        return "the foot never stands in these samples: is it a foot, and are the units m/s2 and rad/s?"
    speeds = [np.hypot(*s.move_m[:2]) / max(s.t_end_s - s.t_start_s, 0.05) for s in steps]
    if speeds and float(np.median(speeds)) > FASTEST_WALK_M_S:
        return f"half of the steps are faster than {np.median(speeds):.0f} m/s: are the units m/s2 and rad/s?"
    if steps and float(np.median([abs(s.move_m[2]) for s in steps])) > HIGHEST_STEP_M:
        return "half of the steps rise or fall by more than a metre: are the units m/s2 and rad/s, and the axes right-handed?"
    if counts.forced > FORCED_SAMPLES and end_sd_m(track) > LOST_SHARE * sum(np.hypot(*s.move_m[:2]) for s in steps):
        return "the foot stands where its motion says that it cannot: are the units m/s2 and rad/s, and the axes right-handed?"
    return ""


def end_sd_m(track: Track) -> float:
    """Standard deviation (m) of the end's horizontal distance from the truth, by the steps' covariances and the growth of the yaw's error."""
    steps = track.steps
    if not steps:
        return 0.0
    places = np.cumsum([step.move_m[:2] for step in steps], axis=0)
    own = sum(float(step.covariance[0, 0] + step.covariance[1, 1]) for step in steps)
    turns = np.array([step.heading_sd_rad for step in steps])
    return math.sqrt(own + float(turns**2 @ ((places[-1] - places) ** 2).sum(axis=1)))
