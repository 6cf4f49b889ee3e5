# SPDX-License-Identifier: MIT
"""Heights above the start and stays on level ground, from a recorded barometer alone: the tracker's height filter without plan and steps.

In: `Pressures`. Out: `HeightRecord`: heights of segments of half a second, `Stay`s. Owns the limits between standing, climbing and a gust.

On level ground nothing rises: there the filter gets a rise of zero, and takes a change of pressure for weather. On the way it gets no rise.
Level ground is found by the speed of the height by pressure over some seconds, and as a whole stay hardly climbs. A door or a fan changes the
pressure sooner than a lift could: a rise of d from rest takes 2 sqrt(d / a).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from echostep.arrays import Bools, Floats, Ints, spans
from echostep.height.height_filter import RelativeHeight
from echostep.height.levels import ClimbSettings, HeightChange
from echostep_app.offline.floors.pressure_csv import COLDEST_C, WARMEST_C, Pressures

AIR_J_KG_K, G0_M_S2, ZERO_C_K = 287.053, 9.80665, 273.15
INDOORS_C = 20.0
BODY_HEAT = 0.5  # share of an excess above INDOORS_C that is the air's: body and electronics warm a device; assumed
# Assumed, tuned on simulated floors (seeds 200 to 209) and on the climbs of loruro/Barometer_STM32
SEGMENT_S = 0.5
QUIETEST_M, AIR_SD_M = 0.02, 0.1  # standard deviations: of a segment's noise, at least; of draughts in a height
SMOOTH_PA, FINEST = 0.02, 0.1  # steps between readings up to this are no quantization; share that may be finer
HALF_S = 3.0  # of the window, to either side, over which a speed is measured; longer where noise makes it uncertain
STILL_M_S = 0.1  # below a slow climb of stairs, landings included
STAY_M_S = 0.04  # of a whole stay; weather of 2 hPa/h makes 0.005
STAY_S, END_S = 8.0, 1.0  # shortest stay; the same at either end of a record
LEVEL_S = 4.0  # at either end of a stay, over which its height is a median
GAP_S = 5.0  # without a sample: a climb may be in it
LIFT_M_S2 = 1.5  # highest acceleration of a lift [ISO 8100-32, typical: 0.8 to 1.2]
EDGE = 0.5  # of the duration of a rise: the part between a tenth and nine tenths of it
NEAR = 8  # segments of the stays beside a way, in which a gust may begin or end
GUST_M, GUST_S = 1.5, 15.0  # smallest gust that could be a storey; the longest that ends by itself


@dataclass(frozen=True, slots=True)
class Stay:
    """Segments `begin` to `end` (not included) on level ground, and the height at either end (m)."""

    begin: int
    end: int
    first_m: float
    last_m: float


@dataclass(frozen=True, slots=True)
class HeightRecord:
    """Of segments (m,): times, heights by pressure and above the start. `segment` (n,) of each sample. Stays (k,), and whether a gust led there."""

    t_s: Floats
    pressure_m: Floats
    height_m: Floats
    segment: Ints
    stays: tuple[Stay, ...]
    gust: tuple[bool, ...] = ()

    def is_gust(self, before: slice, after: slice) -> bool:
        """Whether the height by pressure goes from its median in `before` to that in `after` faster than a lift, and does so once."""
        pressure_m = self.pressure_m[before.start : after.stop]
        from_m, to_m = (float(np.median(self.pressure_m[part])) for part in (before, after))
        if (rise_m := abs(to_m - from_m)) < GUST_M:
            return False
        near_m = max(0.1 * rise_m, 1.5 * AIR_SD_M)
        leaving, arriving = (np.flatnonzero(np.abs(pressure_m - level) <= near_m) for level in (from_m, to_m))
        if not len(leaving) or not len(arriving):  # no segment is near such a median: the height only passes through
            return False
        leaves, arrives = leaving[-1], arriving[0]
        duration_s = float(self.t_s[before.start + arrives] - self.t_s[before.start + leaves])
        return 0.0 < duration_s < EDGE * 2.0 * math.sqrt(rise_m / LIFT_M_S2)


def height_record(samples: Pressures) -> HeightRecord:
    """Heights and stays of a record; a record that never stays has two, its first and its last segment."""
    t_s, pressure_m, segment = _segments(samples)
    sd_m = max(noise_m(pressure_m), coarse_m(samples.pressure_pa))
    still = _stays(t_s, pressure_m, _is_slow(t_s, pressure_m, sd_m))
    height_m = _filtered(t_s, pressure_m, still, math.hypot(AIR_SD_M, sd_m))
    found = [_stay(t_s, height_m, begin, end) for begin, end in spans(still).tolist()]
    if not found or found[0].begin > 0:
        found.insert(0, _stay(t_s, height_m, 0, 1))
    if found[-1].end < len(t_s):
        found.append(_stay(t_s, height_m, len(t_s) - 1, len(t_s)))
    return _without_gusts(HeightRecord(t_s, pressure_m, height_m, segment, tuple(found)))


def heights_by_pressure(samples: Pressures) -> Floats:
    """Height (n,) above the first sample, dh = -(R T / g) dp / p, summed from sample to sample: a change of temperature alone moves no height."""
    metres = AIR_J_KG_K * (_air_c(samples) + ZERO_C_K) / G0_M_S2
    rise_m = -metres[1:] * np.diff(np.log(samples.pressure_pa))
    return np.concatenate([[0.0], np.cumsum(rise_m)])


def _air_c(samples: Pressures) -> Floats:
    """The air's temperature (n,): by the last possible reading, INDOORS_C before the first. An error of 3 K makes 1 % of a rise."""
    if samples.temperature_c is None:
        return np.full(len(samples.t_s), INDOORS_C)
    possible = (samples.temperature_c >= COLDEST_C) & (samples.temperature_c <= WARMEST_C)
    last = np.maximum.accumulate(np.where(possible, np.arange(len(possible)), -1))
    warm_k = np.where(last < 0, 0.0, samples.temperature_c[last] - INDOORS_C)
    return INDOORS_C + np.where(warm_k < 0.0, warm_k, BODY_HEAT * warm_k)


def _segments(samples: Pressures) -> tuple[Floats, Floats, Ints]:
    """Mean times (m,) of segments of SEGMENT_S, or of one sample, medians of the heights by pressure in them, and the segment of each sample (n,)."""
    place = np.floor((samples.t_s - samples.t_s[0]) / SEGMENT_S)
    _, begin, segment, count = np.unique(place, return_index=True, return_inverse=True, return_counts=True)
    height_m = heights_by_pressure(samples)
    ends = zip(begin.tolist(), (begin + count).tolist(), strict=True)
    medians = np.array([np.median(height_m[a:b]) for a, b in ends])
    return np.bincount(segment, samples.t_s) / count, medians, segment


def coarse_m(pressure_pa: Floats) -> float:
    """Error of a height by pressures (n,) in coarse steps: half of a step."""
    steps_pa = np.diff(np.unique(pressure_pa))
    steps_pa = steps_pa[steps_pa > SMOOTH_PA]
    metres = AIR_J_KG_K * (INDOORS_C + ZERO_C_K) / G0_M_S2
    return 0.5 * metres * float(np.quantile(steps_pa, FINEST)) / float(pressure_pa[0]) if len(steps_pa) else 0.0


def noise_m(height_m: Floats) -> float:
    """Standard deviation of a height (n,), robust: from the differences to the mean of both neighbours, which a steady climb leaves at zero.

    Errors that last for longer than one height, as of a sensor that filters, show in the means of two.
    """
    pairs_m = height_m[: len(height_m) // 2 * 2].reshape(-1, 2).mean(axis=1)
    return max(QUIETEST_M, _bend_m(height_m), math.sqrt(2.0) * _bend_m(pairs_m))


def _bend_m(height_m: Floats) -> float:
    if len(height_m) < 5:
        return 0.0
    off_m = height_m[1:-1] - 0.5 * (height_m[:-2] + height_m[2:])
    return 1.4826 * float(np.median(np.abs(off_m))) / math.sqrt(1.5)


def _is_slow(t_s: Floats, height_m: Floats, sd_m: float) -> Bools:
    """Where the means over the window before and after differ by less than STILL_M_S; nowhere beside a gap."""
    if len(t_s) < 2:
        return np.ones(len(t_s), bool)
    step_s = float(np.median(np.diff(t_s)))
    # Four standard deviations of the speed
    uncertain_s = (4.0 * math.sqrt(2.0 * step_s) * sd_m / STILL_M_S) ** (2.0 / 3.0)
    half_s, here = max(HALF_S, 1.5 * step_s, uncertain_s), np.arange(len(t_s))
    begin = np.minimum(np.searchsorted(t_s, t_s - half_s), np.maximum(here - 1, 0))
    end = np.maximum(np.searchsorted(t_s, t_s + half_s, side="right"), np.minimum(here + 2, len(t_s)))
    time_s, change_m = (_mean(each, here, end) - _mean(each, begin, here + 1) for each in (t_s, height_m))
    gap = np.diff(t_s) > GAP_S
    beside_gap = np.concatenate([[False], gap]) | np.concatenate([gap, [False]])
    return np.asarray((np.abs(change_m) < STILL_M_S * time_s) & ~beside_gap)


def _mean(values: Floats, begin: Ints, end: Ints) -> Floats:
    """Means (n,) of values (m,) from `begin` (n,) to before `end` (n,)."""
    total = np.concatenate([[0.0], np.cumsum(values)])
    return np.asarray((total[end] - total[begin]) / (end - begin))


def _stays(t_s: Floats, height_m: Floats, slow: Bools) -> Bools:
    """The stretches of `slow` (m,) that are long enough, and do not climb on the whole."""
    still = np.zeros_like(slow)
    for begin, end in spans(slow).tolist():
        time_s = t_s[begin:end] - t_s[begin:end].mean()
        climbs = abs(time_s @ height_m[begin:end]) > STAY_M_S * (time_s @ time_s)
        at_end = begin == 0 or end == len(t_s)
        still[begin:end] = not climbs and t_s[end - 1] - t_s[begin] >= (END_S if at_end else STAY_S)
    return still


def _filtered(t_s: Floats, pressure_m: Floats, still: Bools, sd_m: float) -> Floats:
    """Height (m,) above the start by the tracker's filter: a stay rises by zero, a way is not measured by steps."""
    filtered = RelativeHeight(ClimbSettings().drift_m)
    height_m = np.empty(len(t_s))
    rows = zip(np.diff(t_s, prepend=t_s[0]).tolist(), pressure_m.tolist(), still.tolist(), strict=True)
    for k, (span_s, measured_m, stays) in enumerate(rows):
        filtered.update(HeightChange(0.0, 0.0 if stays else math.inf, measured_m, sd_m, measured_m, span_s))
        height_m[k] = filtered.height_m
    return height_m


def _stay(t_s: Floats, height_m: Floats, begin: int, end: int) -> Stay:
    first = height_m[begin : min(end, int(np.searchsorted(t_s, t_s[begin] + LEVEL_S)))]
    last = height_m[max(begin, int(np.searchsorted(t_s, t_s[end - 1] - LEVEL_S))) : end]
    return Stay(begin, end, float(np.median(first)), float(np.median(last)))


def _without_gusts(record: HeightRecord) -> HeightRecord:
    """The record with its gusts named; a short stay in the middle of a gust is left out, and a first reading from which a gust leads."""
    kept, gusts = [record.stays[0]], [False]
    for stay in record.stays[1:]:
        before = kept[-1]
        ends = (
            slice(max(before.begin, before.end - NEAR), before.end),
            slice(stay.begin, min(stay.begin + NEAR, stay.end)),
        )
        gust = record.is_gust(*ends)
        if gust and before.end == 1:
            kept, gusts = [stay], [False]
        elif not gust or record.t_s[stay.end - 1] - record.t_s[stay.begin] > GUST_S or stay.end == len(record.t_s):
            kept.append(stay)
            gusts.append(gust)
    return replace(record, stays=tuple(kept), gust=tuple(gusts))
