# SPDX-License-Identifier: MIT
"""Strides from two gyros on one leg: the travel of the hips, stride by stride.

In: time, pitch rates of thigh and shank, either sign, and of the belt, 50 to 500 Hz. Out: `Stride`s in order of time. Owns the bout under way.
`leg_angles` gives the angles, `kinematics` the travel of the hips over a stance, `swing_detection` the swings and the sign of each gyro, `edges` the
first and the last swing.

A stride goes from mid swing to mid swing. Before the first and after the last mid swing the hips move over the standing foot; these edges are
reported, too. A gyro does not measure the vertical (`level`). Its bias is its rate at rest, and the change of its angle over a stride, less
the leak from a turn (`gyro_bias`).

Two gyros in the sagittal plane of one leg do not give the length of strides sideways, backward or in place, or of crawling: these are flagged, their
length is 0, and their standard deviation covers the possible length.
"""

from __future__ import annotations

import numpy as np

from echostep.arrays import Floats
from echostep.legs import swing_detection as leg_swings
from echostep.legs.angle_grid import AngleGrid, GridSample
from echostep.legs.gyro_bias import GyroBias
from echostep.legs.kinematics import FLAT, PELVIS, TOE_OFF, Travel, travel
from echostep.legs.leg_angles import LegAngles, knees
from echostep.legs.stride import Flag, LegCounts, Stride, StrideSettings
from echostep.legs.swing_detection import GRID_HZ, Swings
from echostep.legs.walking_bout import SPEED_S, Bout, Swing, leaving_share, pace_flag, speed, stairs_flag

# The source of a value without a citation is not recorded.
BRIDGED_S = 3.0  # longest gap bridged by the pace before it
# Growth of the sd in a gap or without a swing, and for how long it grows in a gap
UNWATCHED_M_S, LONGEST_DOUBT_S = 0.4, 600.0
FASTEST = 0.75  # relative speed of walking: 2.2 m/s with legs of 0.86 m; above it a person runs [Alexander 1989]
SHORTEST_M = 0.25  # length of a stride: less is a step in place or sideways
LEAST_PASSED = 0.12  # share of the stride that the hips move in single support; 0.25 to 0.3 in walking
LONGEST_ON_STAIRS_M = 1.0  # length of a stride
STAIRS_M, STAIRS_RISE_M = 0.57, 0.34  # two treads of 28.5 and 17 cm; houses differ by 2 cm each [DIN 18065]
STAIRS_WEIGHT = 0.15  # of the length by the angles
OWN_SD_M = 0.06  # of one stride, besides the scale: 99 strides of four real legs
EDGE_SD_M = 0.12  # of an edge of a walk: ten edges of the same legs
# At least, for a stride that this leg does not show: half a usual stride, for it may be none or a whole one
BLIND_SD_M = 0.65
LOOK = 3  # grid samples on either side, from which a rate is computed
SWING_END = 0.35  # of the peak rate: below it the swing is over
STANCE = 62  # percent of a stride
STAYS = 0.44  # last phase of a foot that stays on the floor
FEWEST_SPEED = 6  # grid samples that give a speed, assumed
# Grid samples without motion at either end of a record, which show that it begins or ends with standing, assumed
CALM = 6
FORGET = 500  # grid samples no longer needed, from which on they are dropped
# Strides in a row that confirm the signs, or contradict them: motion before a walk is seldom so regular.
CONFIRMING = 3


class StrideEstimator:
    """Strides from samples, returned when no later sample can change them; equal samples give equal strides, in blocks of any size."""

    def __init__(self, settings: StrideSettings | None = None, sign: tuple[float, float] | None = None) -> None:
        """`sign`: of the gyros of thigh and shank, if known from the same recording."""
        self.settings = settings or StrideSettings()
        self.swings = Swings(sign)
        self.revised = False  # whether the signs were decided again
        self._grid = AngleGrid()
        self._angles = LegAngles(self._grid)
        self._moved = 0  # grid samples with a moving shank
        self._done = 0  # grid samples searched for swings and rest
        self._bout = Bout(0, stood=False)
        self._still_since: int | None = None
        self._peak = (0.0, 0)  # of the swing under way: rate, grid index
        self._strides: list[Stride] = []
        self._keep = 0  # first grid index still needed
        self._confirmed = sign is not None  # whether strides have confirmed the signs

    @property
    def bias(self) -> tuple[GyroBias, GyroBias]:
        """Errors of the gyros of thigh and shank."""
        return self._angles.bias

    @property
    def counts(self) -> LegCounts:
        """Counts of samples."""
        return self._grid.counts

    @property
    def standing_since_s(self) -> float | None:
        """Time since which the leg stands; None while it does not, or is not known to."""
        return None if self._still_since is None else self._grid.time(self._still_since)

    def feed(self, t_s: Floats, thigh: Floats, shank: Floats, belt: Floats | None = None) -> list[Stride]:
        """Strides completed by samples (n,): time, rates in rad/s; `belt`: of the trunk about the vertical, NaN or None if not measured."""
        turns = np.full(len(t_s), np.nan) if belt is None else belt
        for sample in zip(t_s.tolist(), thigh.tolist(), shank.tolist(), turns.tolist(), strict=True):
            self._take(*sample)
        strides, self._strides = self._strides, []
        return strides

    def finish(self) -> list[Stride]:
        """The strides still under way; no samples may follow."""
        if self.swings.known or self.swings.decide(self._grid.rates(), final=True):
            self._advance(len(self._grid))
            if self._still_since is None and len(self._grid) > 1:
                self._end_bout(len(self._grid) - 1, stands=self._rests(len(self._grid) - 1 - CALM))
        strides, self._strides = self._strides, []
        return strides

    def _take(self, t_s: float, thigh: float, shank: float, belt: float) -> None:
        """Take one sample; search the grid that it fills once the signs are known."""
        before = len(self._grid)
        kind = self._grid.add(t_s, thigh, shank, belt)
        if kind is GridSample.AFTER_GAP:
            self._bridge_gap(t_s)
            self._grid.restart(t_s, thigh, shank, belt)
            return
        if kind is GridSample.SKIPPED or len(self._grid) == before:
            return
        if self.swings.known:
            self._advance(len(self._grid) - LOOK)
            return
        shanks = self._grid.shank
        for k in range(max(before, 1), len(self._grid)):
            if abs(shanks[k] - shanks[k - 1]) * GRID_HZ > leg_swings.MOVING_RAD_S:
                self._moved += 1
                enough = self._moved >= leg_swings.DECIDE_S * GRID_HZ and self._moved % 20 == 0
                if enough and self.swings.decide(self._grid.rates(), final=False):
                    self._advance(len(self._grid) - LOOK)
                    return

    def _bridge_gap(self, t_s: float) -> None:
        """Samples are missing up to `t_s`: end the bout, and bridge a short gap at its pace."""
        t0 = self._grid.last_s
        if not self.swings.known and not self.swings.decide(self._grid.rates(), final=True):
            pace = 0.0
        else:
            self._advance(len(self._grid))
            pace = 0.0 if self._still_since is not None else self._bout.pace_m_s or 0.0
            if self._still_since is None and len(self._grid) > 1:
                self._end_bout(len(self._grid) - 1, stands=False)
        span_s = t_s - t0
        length = pace * span_s if span_s < BRIDGED_S else 0.0
        self._add_stride(t0, t_s, length, UNWATCHED_M_S * min(span_s, LONGEST_DOUBT_S), 0.0, Flag.GAP)
        self._done = 0
        self._angles.forget_level()
        self._bout, self._still_since, self._peak, self._keep = Bout(0, stood=False), None, (0.0, 0), 0

    def _advance(self, until: int) -> None:
        """Search the grid up to index `until` for swings and rest."""
        while self._done < until:
            k = self._done
            self._done += 1
            if k < LOOK:
                continue
            shank = self._grid.shank
            ahead = min(k + LOOK, len(shank) - 1)
            turned = (shank[ahead] - shank[k - LOOK]) * GRID_HZ / (ahead - k + LOOK)
            self._watch_swing(k, self.swings.sign[1] * turned - self.bias[1].value)
            if k % 5 == 0 and k >= leg_swings.STILL:
                self._watch_rest(k)
        self._drop()

    def _watch_swing(self, k: int, rate: float) -> None:
        """Detect the end of a swing: the shank's rate (rad/s) at grid index k is well below its peak."""
        if rate > max(self.swings.threshold(), self._peak[0]):
            self._peak = (rate, k)
        peak, peak_index = self._peak
        if peak > 0.0 and rate < SWING_END * peak:
            self._peak = (0.0, 0)
            first = max(peak_index - leg_swings.HALF_SWING, 0)
            rates = self.swings.sign[1] * np.diff(self._grid.shank[first : k + 1]) * GRID_HZ - self.bias[1].value
            middle = first + leg_swings.mid_swing_index(rates, peak_index - first)
            if not self._bout.peaks or middle - self._bout.peaks[-1] >= leg_swings.SHORTEST_CYCLE:
                self.swings.add_peak(peak)
                self._add_swing(middle)
        peaks = self._bout.peaks
        if peaks and k - peaks[-1] > leg_swings.LONGEST_CYCLE:
            self._end_bout(k, stands=True)
        if not peaks and self._still_since is None:
            self._pass_without_swing(k - leg_swings.STILL)

    def _pass_without_swing(self, end: int) -> None:
        """Report the time of a longest stride up to a grid index before which no rest can begin any more, if the thigh moved without a swing."""
        begin, thigh = end - leg_swings.LONGEST_CYCLE, self._grid.thigh
        if begin < self._bout.begin or (begin - self._bout.begin) % leg_swings.LONGEST_CYCLE != 0:
            return
        rates = self.swings.sign[0] * np.diff(thigh[begin : end + 1]) * GRID_HZ - self.bias[0].value
        if float(np.abs(rates).mean()) < leg_swings.MOVING_RAD_S:
            return
        span_s = leg_swings.LONGEST_CYCLE / GRID_HZ
        self._add_stride(self._grid.time(begin), self._grid.time(end), 0.0, UNWATCHED_M_S * span_s, 0.0, Flag.UNSEEN)
        self._bout.begin = self._keep = end

    def _watch_rest(self, k: int) -> None:
        """Detect standing: it ends a bout, measures the gyros' biases and the level."""
        first, shank = k - leg_swings.STILL, self._grid.shank
        if self._still_since is None and abs(shank[k] - shank[k - 10]) * GRID_HZ / 10.0 > leg_swings.MOVING_RAD_S:
            return
        window = np.column_stack([self._grid.thigh[first : k + 1], shank[first : k + 1]])
        rates = np.diff(window, axis=0) * GRID_HZ
        smoothed = np.column_stack([leg_swings.smooth(rates[:, 0]), leg_swings.smooth(rates[:, 1])])
        if not leg_swings.is_still(smoothed):
            if self._still_since is not None:
                self._end_standing(k - 5)
                self._still_since = None
            return
        if self._still_since is None:
            if first > self._bout.begin and self._bout.peaks:
                self._end_bout(first, stands=True)
            self._still_since = first
            self._angles.begin_rest(self.swings.sign, k)
        self._angles.learn_rest(self.swings.sign, rates.mean(axis=0), (k - self._still_since) / GRID_HZ, k)
        self._bout = Bout(k, stood=True, pace_m_s=0.0)

    def _end_standing(self, k: int) -> None:
        """Report standing up to grid index k."""
        assert self._still_since is not None
        begin = self._still_since
        if k > begin:
            self._add_stride(self._grid.time(begin), self._grid.time(k), 0.0, 0.0, 0.0, Flag.STANDING)
        self._bout.begin = min(max(self._bout.begin, begin), k)
        self._keep = begin

    def _add_swing(self, k: int) -> None:
        """Complete a stride by the mid swing at grid index k; the first stride also completes the edge before it."""
        bout = self._bout
        bout.peaks.append(k)
        if len(bout.peaks) < 2:
            return
        previous = bout.peaks[-2]
        bout.cycle = k - previous
        self._angles.learn_closure(self.swings.sign, previous, k, first=len(bout.peaks) == 2)
        self._angles.correct_level(self.swings.sign, previous, k)
        thigh, shank = self._angles.between(self.swings.sign, previous, k)
        length, rise, flags, sd = self._stride(thigh, shank)
        bout.pace_m_s = length * GRID_HZ / bout.cycle
        bout.blind = flags & (Flag.UNSEEN | Flag.BACKWARD)
        if len(bout.peaks) == 2 and previous > bout.begin:
            edge, less = self._begin_piece(previous, bout.strike)
            self._add_edge(bout.begin, previous, edge)
            length = max(length - less, 0.0)
        self._add_stride(self._grid.time(previous), self._grid.time(k), length, sd, rise, flags)
        self._angles.move_level(self.swings.sign, k)
        self._keep = previous if self._confirmed else bout.peaks[max(-CONFIRMING - 1, -len(bout.peaks))]
        self._confirm_signs(k)

    def _confirm_signs(self, k: int) -> None:
        """Decide the signs once more by the first strides in a row: the first decision may come from motion that was no walk."""
        peaks = self._bout.peaks
        if self._confirmed or len(peaks) <= CONFIRMING:
            return
        first, anew = peaks[-CONFIRMING - 1], Swings()
        if not anew.decide(self._grid.rates(first), final=False):
            return
        self._confirmed = True
        if anew.sign == self.swings.sign:
            return
        for bias, old, new in zip(self.bias, self.swings.sign, anew.sign, strict=True):
            if old != new:
                bias.flip()
        self.swings, self.revised = anew, True
        self._bout, self._peak = Bout(k, stood=False), (0.0, 0)
        self._angles.forget_level(k)

    def _stride(self, thigh: Floats, shank: Floats) -> tuple[float, float, Flag, float]:
        """Length, rise, flags and sd of the stride with these angles (n,), from mid swing to mid swing."""
        cycle = len(shank) - 1
        strike = leg_swings.heel_strike_index(shank)
        phase = np.arange(len(shank)) / cycle - strike / cycle
        stance = phase[strike:], thigh[strike:], shank[strike:]
        rise = travel(*stance, self.settings.segments, struck=None, rolls=False).stride()[1]
        stairs = stairs_flag(*knees(*stance), 0.5 * rise)
        way = travel(*stance, self.settings.segments, struck=None if stairs else 0.0, rolls=not stairs)
        if not stairs:
            way = travel(*stance, self.settings.segments, speed=self._relative_speed(way, cycle))
        length = way.stride()[0]
        trailing = (np.interp(TOE_OFF, phase, angle) for angle in (thigh, shank))
        self._bout.trail_m = -self.settings.segments.ankle_ahead_m(*trailing)
        rate = leg_swings.smooth(np.diff(shank) * GRID_HZ)
        self._bout.strike = strike
        self._bout.toe_off = self._bout.peaks[-2] + leg_swings.toe_off_index(rate, len(rate) - 1, strike)
        self._bout.add_lead(leg_swings.thigh_lead(np.column_stack([np.diff(thigh), np.diff(shank)])))
        if self._bout.lead < leg_swings.BACKWARD_LEAD:
            return 0.0, 0.0, Flag.BACKWARD, max(BLIND_SD_M, abs(length))
        if length < SHORTEST_M or way.passed() < LEAST_PASSED * length:
            return 0.0, 0.0, Flag.UNSEEN, max(BLIND_SD_M, abs(length))
        if stairs and length < LONGEST_ON_STAIRS_M:
            length = STAIRS_M + STAIRS_WEIGHT * (length - STAIRS_M)
            return length, STAIRS_RISE_M if Flag.STAIRS_UP in stairs else -STAIRS_RISE_M, stairs, 2.0 * OWN_SD_M
        return length, 0.0, pace_flag(length * GRID_HZ / cycle, self.settings.segments), OWN_SD_M

    def _relative_speed(self, way: Travel, cycle: int) -> float:
        """Relative speed of a stride of `cycle` grid samples; from unscaled lengths, so that lengths are linear in their scale."""
        segments = self.settings.segments
        return min(segments.relative_speed(way.stride()[0] / segments.scale * GRID_HZ / cycle), FASTEST)

    def _begin_piece(self, peak: int, strike: int | None) -> tuple[float, float]:
        """Travel (m) from the beginning of the walk to its first mid swing, and how much shorter the next stride is than in a steady walk.

        `strike`: grid samples from mid swing to heel strike; None when no stride follows.
        """
        bout = self._bout
        span, pace = peak - bout.begin, bout.pace_m_s or 0.0
        thigh, shank = self._angles.between(self.swings.sign, bout.begin, peak)
        rate = leg_swings.smooth(np.diff(shank) * GRID_HZ)
        off = leg_swings.toe_off_index(rate, span - 1, 0)
        phase = TOE_OFF + (np.arange(len(shank)) - off) / bout.cycle
        stood = bout.stood or self._calm(rate[: max(off - STANCE * bout.cycle // 100, 0)])
        stance = 0 if stood else int(np.argmax(phase > 0.0))
        way = travel(phase, thigh, shank, self.settings.segments, struck=None)
        length = PELVIS * float(way.forward_m[off] - way.forward_m[stance]) + pace * stance / GRID_HZ
        leaving = pace
        if bout.stood or (stood and (phase[0] < -0.1 or self._rests(bout.begin))):
            leaving *= leaving_share(-self.settings.segments.ankle_ahead_m(thigh[off], shank[off]), bout.trail_m)
        swing = Swing(leaving, pace, (span - off) / GRID_HZ, (strike or 0) / GRID_HZ)
        return length + swing.first_half_m(), pace * swing.after_s - swing.second_half_m()

    def _rests(self, first: int) -> bool:
        """Whether neither sensor moves in the CALM grid samples from an index on: in a walk this happens only where it begins or ends."""
        rates = self._grid.rates(max(first, 0))[:CALM] * np.array(self.swings.sign) - np.array(
            [b.value for b in self.bias]
        )
        return len(rates) > 0 and float(np.abs(rates).max()) < leg_swings.MOVING_RAD_S

    def _calm(self, rate: Floats) -> bool:
        """Whether the shank's rates (n,) hold no swing, so that the foot stands."""
        return not len(rate) or float(np.abs(rate).max()) < 0.4 * self.swings.threshold() / leg_swings.PEAK_SHARE

    def _end_bout(self, end: int, *, stands: bool) -> None:
        """End the bout at this grid index, because the leg stands or because the samples end."""
        bout = self._bout
        if len(bout.peaks) == 1:
            self._end_step(bout.peaks[0], end, stands=stands)
        elif bout.peaks and end > bout.peaks[-1]:
            self._add_edge(bout.peaks[-1], end, self._end_piece(bout.peaks[-1], end, stands=stands))
        self._bout = Bout(end, stood=False)
        self._keep = end - leg_swings.STILL

    def _end_step(self, peak: int, end: int, *, stands: bool) -> None:
        """End a bout with one swing only: a step, or a lifted foot."""
        bout = self._bout
        bout.toe_off = peak
        begins = self._begin_piece(peak, None)[0] if peak > bout.begin else 0.0
        length = begins + (self._end_piece(peak, end, stands=stands) if end > peak else 0.0)
        if length < SHORTEST_M:
            bout.blind = Flag.UNSEEN
        self._add_edge(bout.begin, end, length)

    def _end_piece(self, peak: int, end: int, *, stands: bool) -> float:
        """Travel (m) from the last mid swing to the end of the walk, less the excess length counted for the stride before it."""
        bout, span = self._bout, end - peak
        pace = bout.pace_m_s or 0.0
        thigh, shank = self._angles.between(self.swings.sign, peak, end)
        strike = leg_swings.heel_strike_index(shank)
        phase = (np.arange(strike, len(shank)) - strike) / bout.cycle
        last = len(phase) - 1
        if stands:
            phase = np.minimum(phase, STAYS)
        else:
            last = min(last, int(TOE_OFF * bout.cycle))
        way = travel(phase, thigh[strike:], shank[strike:], self.settings.segments)
        length = PELVIS * float(way.forward_m[last] - way.forward_m[0]) + pace * (span - strike - last) / GRID_HZ
        flat = int(FLAT * bout.cycle)
        seen = stands or last >= flat + FEWEST_SPEED
        landing = PELVIS * speed(way, flat, flat + int(SPEED_S * GRID_HZ), GRID_HZ, pace) if seen else pace
        swing = Swing(pace, landing, (peak - bout.toe_off) / GRID_HZ, strike / GRID_HZ)
        return length + swing.second_half_m() + swing.first_half_m() - pace * swing.before_s

    def _add_edge(self, begin: int, end: int, length: float) -> None:
        """Report an edge of a walk; next to a stride of unknown length its length is unknown, too."""
        blind = self._bout.blind
        length, sd = (0.0, BLIND_SD_M) if blind else (max(length, 0.0), EDGE_SD_M)
        self._add_stride(self._grid.time(begin), self._grid.time(end), length, sd, 0.0, Flag.EDGE | blind)

    def _add_stride(self, t0: float, t1: float, length: float, sd: float, rise: float, flags: Flag) -> None:
        """Report a stride."""
        self._strides.append(Stride(t0, t1, length, sd, self.settings.scale_sd, rise, flags))

    def _drop(self) -> None:
        """Drop grid values that are no longer needed."""
        k = min(self._keep, self._angles.level.index)
        if k < FORGET:
            return
        self._keep = 0
        self._grid.drop(k)
        self._done -= k
        self._angles.drop(k)
        bout = self._bout
        bout.begin -= k
        bout.toe_off -= k
        bout.peaks = [peak - k for peak in bout.peaks]
        if self._still_since is not None:
            self._still_since -= k
        self._peak = (self._peak[0], self._peak[1] - k)
