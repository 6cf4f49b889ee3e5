"""Strides from two gyros on one leg: the travel of the hips, stride by stride.

In: time and pitch rates of thigh and shank, 50 to 500 Hz, either sign. Out: `Stride`s in order of time. Owns the angles, the gyros' biases and
the bout under way. `kinematics` gives the travel of the hips over a stance, `swing_detection` the swings and the sign of each gyro.

A stride goes from mid swing to mid swing. Before the first and after the last mid swing the hips move over the standing foot; these edges are
reported, too. A gyro does not measure the vertical: the leg is taken as upright at rest, and its mean angle over a stride as the usual one.
Each gyro's bias is its rate at rest, and the change of its angle over a stride.

Two gyros in the sagittal plane of one leg do not give the length of strides sideways, backward or in place: these are flagged, their length is 0,
and their standard deviation covers the possible length.
"""

from __future__ import annotations

import math

import numpy as np

from echostep.arrays import Floats
from echostep.legs import swing_detection as leg_swings
from echostep.legs.kinematics import (
    MEAN_SHANK_RAD,
    MEAN_THIGH_RAD,
    PELVIS,
    STANDING_SHANK_RAD,
    STANDING_THIGH_RAD,
    TOE_OFF,
    knee_at,
    travel,
)
from echostep.legs.stride import Flag, LegCounts, Stride, StrideSettings
from echostep.legs.swing_detection import GRID_HZ, Swings
from echostep.legs.walking_bout import Bout, GyroBias, edge_pace, pace_flag, stairs_flag

# The source of a value without a citation is not recorded.
LONGEST_GAP_S = 0.25  # integrated over
BRIDGED_S = 3.0  # longest gap bridged by the pace before it
UNWATCHED_M_S, LONGEST_DOUBT_S = 0.4, 600.0  # growth of the sd in a gap, and for how long it grows
FASTEST_RAD_S = 35.0  # a larger rate is impossible
SHORTEST_M = 0.25  # length of a stride: less is a step in place or sideways
LEAST_PASSED = 0.12  # share of the stride that the hips move in single support; 0.25 to 0.3 in walking
LONGEST_ON_STAIRS_M = 1.0  # length of a stride
STAIRS_M, STAIRS_RISE_M = 0.57, 0.34  # two treads of 28.5 and 17 cm; houses differ by 2 cm each [DIN 18065]
STAIRS_WEIGHT = 0.15  # of the length by the angles
LEVEL_STRIDE_M = 0.85  # longer than any on stairs
LEVEL_GAIN = 0.15  # of the correction of mean angles per stride
CLOSURE_SD_RAD = math.radians(2.5)  # of the change of an angle over a stride
SCALE_SD = 0.035  # of the common scale of all strides, by the lengths of the leg alone
CALIBRATED_SD = 0.012  # the same after a walk of known length
OWN_SD_M = 0.04  # of one stride, besides
EDGE_SD_M = 0.08  # of an edge of a walk
BLIND_SD_M = 0.4  # of a stride that this leg does not show
REST_SD_RAD_S = math.radians(0.15)  # of the bias by one window of rest
LOOK = 3  # grid samples on either side, from which a rate is computed
SWING_END = 0.35  # of the peak rate: below it the swing is over
STANCE = 62  # percent of a stride
STAYS = 0.44  # last phase of a foot that stays on the floor
FORGET = 500  # grid samples no longer needed, from which on they are dropped


class StrideEstimator:
    """Strides from samples, returned when no later sample can change them; equal samples give equal strides, in blocks of any size."""

    def __init__(self, settings: StrideSettings | None = None) -> None:
        self.settings = settings or StrideSettings()
        self.counts = LegCounts()
        self.swings = Swings()
        self.bias = (GyroBias(), GyroBias())
        self._last: tuple[float, float, float] | None = None  # t, thigh, shank of the newest sample
        self._turned = (0.0, 0.0)  # angles since the first sample, with the sensors' signs and biases
        self._origin_s = 0.0
        self._thigh: list[float] = []  # `_turned` every 1 / GRID_HZ
        self._shank: list[float] = []
        self._moved = 0  # grid samples with a moving shank
        self._done = 0  # grid samples searched for swings and rest
        self._bout = Bout(0, stood=False)
        self._still_since: int | None = None
        self._peak = (0.0, 0)  # of the swing under way: rate, grid index
        self._strides: list[Stride] = []
        self._keep = 0  # first grid index still needed

    @property
    def standing_since_s(self) -> float | None:
        """Time since which the leg stands; None while it does not, or is not known to."""
        return None if self._still_since is None else self._time(self._still_since)

    def feed(self, t_s: Floats, thigh: Floats, shank: Floats) -> list[Stride]:
        """Strides completed by samples (n,): time, rates in rad/s."""
        for sample in zip(t_s.tolist(), thigh.tolist(), shank.tolist(), strict=True):
            self._integrate(*sample)
        strides, self._strides = self._strides, []
        return strides

    def finish(self) -> list[Stride]:
        """The strides still under way; no samples may follow."""
        if self.swings.known or self.swings.decide(self._rates(), final=True):
            self._advance(len(self._thigh))
            if self._still_since is None and len(self._thigh) > 1:
                self._end_bout(len(self._thigh) - 1, stands=False)
        strides, self._strides = self._strides, []
        return strides

    def _integrate(self, t_s: float, thigh: float, shank: float) -> None:
        """Integrate to one sample and interpolate the angles on the grid."""
        self.counts.samples += 1
        if not abs(thigh) < FASTEST_RAD_S or not abs(shank) < FASTEST_RAD_S or not math.isfinite(t_s):
            self.counts.impossible += 1
            return
        if self._last is None:
            self._last, self._origin_s = (t_s, thigh, shank), t_s
            self._thigh, self._shank = [0.0], [0.0]
            return
        t0, *before = self._last
        if t_s <= t0:
            self.counts.not_later += 1
            return
        if t_s - t0 > LONGEST_GAP_S:
            self._bridge_gap(t_s)
            self._last = (t_s, thigh, shank)
            return
        turned = tuple(
            a + 0.5 * (t_s - t0) * (x + y) for a, x, y in zip(self._turned, before, (thigh, shank), strict=True)
        )
        while (grid_s := self._origin_s + len(self._thigh) / GRID_HZ) <= t_s:
            share = (grid_s - t0) / (t_s - t0)
            self._append(*(a + share * (b - a) for a, b in zip(self._turned, turned, strict=True)))
        self._turned, self._last = (turned[0], turned[1]), (t_s, thigh, shank)

    def _append(self, thigh: float, shank: float) -> None:
        """Append angles to the grid; search them once the signs are known."""
        self._thigh.append(thigh)
        self._shank.append(shank)
        if self.swings.known:
            self._advance(len(self._thigh) - LOOK)
            return
        if abs(self._shank[-1] - self._shank[-2]) * GRID_HZ > leg_swings.MOVING_RAD_S:
            self._moved += 1
            enough = self._moved >= leg_swings.DECIDE_S * GRID_HZ and self._moved % 20 == 0
            if enough and self.swings.decide(self._rates(), final=False):
                self._advance(len(self._thigh) - LOOK)

    def _bridge_gap(self, t_s: float) -> None:
        """Samples are missing up to `t_s`: end the bout, and bridge a short gap at its pace."""
        assert self._last is not None
        self.counts.gaps += 1
        t0 = self._last[0]
        if not self.swings.known and not self.swings.decide(self._rates(), final=True):
            pace = 0.0
        else:
            self._advance(len(self._thigh))
            pace = 0.0 if self._still_since is not None else self._bout.pace_m_s or 0.0
            if self._still_since is None and len(self._thigh) > 1:
                self._end_bout(len(self._thigh) - 1, stands=False)
        span_s = t_s - t0
        length = pace * span_s if span_s < BRIDGED_S else 0.0
        self._add_stride(t0, t_s, length, UNWATCHED_M_S * min(span_s, LONGEST_DOUBT_S), 0.0, Flag.GAP)
        self._origin_s, self._turned = t_s, (0.0, 0.0)
        self._thigh, self._shank, self._done = [0.0], [0.0], 0
        self._bout, self._still_since, self._peak, self._keep = Bout(0, stood=False), None, (0.0, 0), 0

    def _rates(self) -> Floats:
        return np.diff(np.column_stack([self._thigh, self._shank]), axis=0) * GRID_HZ

    def _advance(self, until: int) -> None:
        """Search the grid up to index `until` for swings and rest."""
        while self._done < until:
            k = self._done
            self._done += 1
            if k < LOOK:
                continue
            ahead = min(k + LOOK, len(self._shank) - 1)
            turned = (self._shank[ahead] - self._shank[k - LOOK]) * GRID_HZ / (ahead - k + LOOK)
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
            if not self._bout.peaks or peak_index - self._bout.peaks[-1] >= leg_swings.SHORTEST_CYCLE:
                self.swings.add_peak(peak)
                self._add_swing(peak_index)
        peaks = self._bout.peaks
        if peaks and k - peaks[-1] > leg_swings.LONGEST_CYCLE:
            self._end_bout(k, stands=True)

    def _watch_rest(self, k: int) -> None:
        """Detect standing: it ends a bout, measures the gyros' biases and sets the leg upright."""
        first = k - leg_swings.STILL
        if (
            self._still_since is None
            and abs(self._shank[k] - self._shank[k - 10]) * GRID_HZ / 10.0 > leg_swings.MOVING_RAD_S
        ):
            return
        window = np.column_stack([self._thigh[first : k + 1], self._shank[first : k + 1]])
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
        for bias, sign, rate in zip(self.bias, self.swings.sign, rates.mean(axis=0).tolist(), strict=True):
            bias.learn(sign * rate, REST_SD_RAD_S)
        self._bout = Bout(k, stood=True, level=(STANDING_THIGH_RAD, STANDING_SHANK_RAD), level_index=k, pace_m_s=0.0)

    def _end_standing(self, k: int) -> None:
        """Report standing up to grid index k."""
        assert self._still_since is not None
        begin = self._still_since
        if k > begin:
            self._add_stride(self._time(begin), self._time(k), 0.0, 0.0, 0.0, Flag.STANDING)
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
        if len(bout.peaks) > 2 or not bout.stood:
            self._learn_closure(previous, k)
        if bout.level is None:
            bout.level, bout.level_index = (0.0, 0.0), previous
            thigh, shank = self._angles(previous, k)
            bout.level = (MEAN_THIGH_RAD - float(thigh.mean()), MEAN_SHANK_RAD - float(shank.mean()))
        thigh, shank = self._angles(previous, k)
        length, rise, flags, sd = self._stride(thigh, shank)
        pace = length * GRID_HZ / bout.cycle
        bout.blind = flags & (Flag.UNSEEN | Flag.BACKWARD)
        if len(bout.peaks) == 2 and previous > bout.begin:
            self._add_edge(bout.begin, previous, self._begin_piece(previous, pace))
        self._add_stride(self._time(previous), self._time(k), length, sd, rise, flags)
        bout.pace_m_s = pace
        self._relevel(k, thigh, shank, length)
        self._keep = previous

    def _stride(self, thigh: Floats, shank: Floats) -> tuple[float, float, Flag, float]:
        """Length, rise, flags and sd of the stride with these angles (n,), from mid swing to mid swing."""
        cycle = len(shank) - 1
        strike = leg_swings.heel_strike_index(shank)
        phase = np.arange(len(shank)) / cycle - strike / cycle
        stance = phase[strike:], thigh[strike:], shank[strike:]
        self._bout.reach_m = self.settings.segments.ankle_ahead_m(thigh[strike], shank[strike])
        self._bout.trail_m = -self.settings.segments.ankle_ahead_m(
            *(np.interp(TOE_OFF, phase, angle) for angle in (thigh, shank))
        )
        stairs = stairs_flag(knee_at(*stance, wanted_phase=0.02), knee_at(*stance, wanted_phase=0.5))
        way = travel(*stance, self.settings.segments, struck=None if stairs else 0.0, rolls=not stairs)
        length = way.stride()[0]
        rates = np.column_stack([np.diff(thigh), np.diff(shank)])
        if leg_swings.thigh_lead(rates) < leg_swings.BACKWARD_LEAD:
            return 0.0, 0.0, Flag.BACKWARD, max(BLIND_SD_M, abs(length))
        if length < SHORTEST_M or way.passed() < LEAST_PASSED * length:
            return 0.0, 0.0, Flag.UNSEEN, BLIND_SD_M
        if stairs and length < LONGEST_ON_STAIRS_M:
            length = STAIRS_M + STAIRS_WEIGHT * (length - STAIRS_M)
            return length, STAIRS_RISE_M if Flag.STAIRS_UP in stairs else -STAIRS_RISE_M, stairs, 2.0 * OWN_SD_M
        return length, 0.0, pace_flag(length * GRID_HZ / cycle, self.settings.segments), OWN_SD_M

    def _learn_closure(self, begin: int, end: int) -> None:
        """Update the biases by the change of the angles over a stride, which is 0 without bias."""
        span_s = (end - begin) / GRID_HZ
        for bias, sign, angle in zip(self.bias, self.swings.sign, (self._thigh, self._shank), strict=True):
            bias.learn(sign * (angle[end] - angle[begin]) / span_s, CLOSURE_SD_RAD / span_s)

    def _relevel(self, k: int, thigh: Floats, shank: Floats, length_m: float) -> None:
        """Set the level to the angles at the end of a stride, corrected in part so that their mean over the stride is the usual one.

        A short stride is not corrected, as it may be on stairs.
        """
        ends, gain = [], LEVEL_GAIN if length_m > LEVEL_STRIDE_M else 0.0
        for angle, usual in ((thigh, MEAN_THIGH_RAD), (shank, MEAN_SHANK_RAD)):
            off = float(angle.mean()) - usual
            ends.append(float(angle[-1]) - gain * off)
        self._bout.level, self._bout.level_index = (ends[0], ends[1]), k

    def _begin_piece(self, peak: int, pace_m_s: float) -> float:
        """Travel (m) from the beginning of the walk to its first mid swing."""
        bout = self._bout
        span = peak - bout.begin
        thigh, shank = self._angles(bout.begin, peak)
        rate = leg_swings.smooth(np.diff(shank) * GRID_HZ)
        off = leg_swings.toe_off_index(rate, span - 1, 0)
        phase = TOE_OFF + (np.arange(len(shank)) - off) / bout.cycle
        stood = bout.stood or self._calm(rate[: max(off - STANCE * bout.cycle // 100, 0)])
        stance = 0 if stood else int(np.argmax(phase > 0.0))
        swinging = 1.0
        if bout.stood or (stood and phase[0] < -0.1):
            swinging = edge_pace(-self.settings.segments.ankle_ahead_m(thigh[off], shank[off]), bout.trail_m)
        way = travel(phase, thigh, shank, self.settings.segments, struck=None)
        length = PELVIS * float(way.forward_m[off] - way.forward_m[stance])
        return length + pace_m_s * (stance + swinging * (span - off)) / GRID_HZ

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
        if bout.level is None:
            bout.level, bout.level_index = (MEAN_THIGH_RAD, 0.0), peak
        begins = self._begin_piece(peak, bout.pace_m_s or 0.0) if peak > bout.begin else 0.0
        length = begins + (self._end_piece(peak, end, stands=stands) if end > peak else 0.0)
        if length < SHORTEST_M:
            bout.blind = Flag.UNSEEN
        self._add_edge(bout.begin, end, length)

    def _end_piece(self, peak: int, end: int, *, stands: bool) -> float:
        """Travel (m) from the last mid swing to the end of the walk."""
        bout, span = self._bout, end - peak
        pace = bout.pace_m_s or 0.0
        thigh, shank = self._angles(peak, end)
        strike = leg_swings.heel_strike_index(shank)
        phase = (np.arange(strike, len(shank)) - strike) / bout.cycle
        last = len(phase) - 1
        if stands:
            phase = np.minimum(phase, STAYS)
        else:
            last = min(last, int(TOE_OFF * bout.cycle))
        way = travel(phase, thigh[strike:], shank[strike:], self.settings.segments)
        length = PELVIS * float(way.forward_m[last] - way.forward_m[0])
        swinging = (
            edge_pace(self.settings.segments.ankle_ahead_m(thigh[strike], shank[strike]), bout.reach_m)
            if stands
            else 1.0
        )
        return length + pace * (swinging * strike + span - strike - last) / GRID_HZ

    def _add_edge(self, begin: int, end: int, length: float) -> None:
        """Report an edge of a walk; beside a stride of unknown length its length is unknown, too."""
        blind = self._bout.blind
        length, sd = (0.0, BLIND_SD_M) if blind else (max(length, 0.0), EDGE_SD_M)
        self._add_stride(self._time(begin), self._time(end), length, sd, 0.0, Flag.EDGE | blind)

    def _angles(self, begin: int, end: int) -> tuple[Floats, Floats]:
        """Angles (n,) of thigh and shank at grid indices begin..end, from the last level with the present biases."""
        bout = self._bout
        level = bout.level or (0.0, 0.0)
        indices = np.arange(begin, end + 1)
        angles = []
        for turned, sign, bias, start in zip(
            (self._thigh, self._shank), self.swings.sign, self.bias, level, strict=True
        ):
            angle = sign * (np.array(turned[begin : end + 1]) - turned[bout.level_index])
            angles.append(start + angle - bias.value * (indices - bout.level_index) / GRID_HZ)
        return angles[0], angles[1]

    def _time(self, k: int) -> float:
        return self._origin_s + k / GRID_HZ

    def _add_stride(self, t0: float, t1: float, length: float, sd: float, rise: float, flags: Flag) -> None:
        """Report a stride."""
        scale_sd = CALIBRATED_SD if self.settings.calibrated else SCALE_SD
        self._strides.append(Stride(t0, t1, length, sd, scale_sd, rise, flags))

    def _drop(self) -> None:
        """Drop grid values that are no longer needed."""
        k = self._keep
        if k < FORGET:
            return
        self._keep = 0
        del self._thigh[:k], self._shank[:k]
        self._origin_s += k / GRID_HZ
        self._done -= k
        bout = self._bout
        bout.begin -= k
        bout.level_index -= k
        bout.peaks = [peak - k for peak in bout.peaks]
        if self._still_since is not None:
            self._still_since -= k
        self._peak = (self._peak[0], self._peak[1] - k)
