# SPDX-License-Identifier: MIT
"""The foot's heading, corrected for the drift that the belt gyro does not confirm.

In: blocks of belt rates, steps and stances of the foot (walk frame), in order of their messages. Out: the same steps, turned, and the belt's evidence
for each. Owns the filter of foot less belt heading and the correction of the foot's heading.

In the middle of each stance, and at both ends of standing, foot less belt heading is measured. The filter's estimate of the foot's error is
divided by the variances of both turns. Only a recent error is corrected: a bias found later must not bend the path already walked, or all
corrections would sum up to the foot's own drift. In the long run the foot is more accurate, since its error grows with the root of time: the
correction fades. A drawing, which needs no heading at once, uses a smoother [mapping.smoothed_heading].

Without evidence that the belt gyro turns with the foot the correction is kept as it is: a dead, loose or reversed gyro never corrects. A gap of foot
or belt, or REFUSALS stances in a row beyond the gate, restart the evidence.
"""

from __future__ import annotations

import math
from dataclasses import replace

from echostep.elementary import wrap
from echostep.foot.alignment import rotated_event
from echostep.foot.steps import Stance, Step
from echostep.legs.trunk_path import GyroBlock
from echostep.odometry.belt_angle import BeltAngle
from echostep.odometry.heading_filter import BIAS, CORRELATED_S, FOOT, OFFSET, HeadingFilter
from echostep.path import BeltEvidence, StanceHeadings

REST_S = 1.0  # a longer stance is standing [foot.trunk_path], which is measured near both ends:
EDGE_S = 0.25  # half a stance from them
# Walking adds to the bias by turns about the other axes: two belts on one pelvis differ by 0.08 deg/s more in walking than at rest [legs_qmt].
WALKING_RAD_S = math.radians(0.06)
# Some strides, in which jitter lets the filter find an error of the foot; older errors are no longer sought
RECENT_S = 10.0
REFUSALS = 3  # stances in a row, assumed
# A stride's turn is known to a degree; beyond this the foot's samples were missing, and its frame is a new one
LOST_RAD = math.radians(10.0)


class HeadingFusion:
    """Call `add_belt` and `corrected` in order of the messages."""

    def __init__(self) -> None:
        self.correction_rad = 0.0  # known error of the foot's heading so far
        self.evidence: BeltEvidence | None = None  # of the last step; None before there is a belt
        self._belt = BeltAngle()
        self._filter: HeadingFilter | None = None
        self._last: StanceHeadings | None = None  # measured last
        self._growth = 0.0  # variance of the foot's turn since then, rad2
        self._share = 0.0  # of the foot's turn error that the last stance has taken out, and the next is expected to
        self._promised = 0.0  # variance (rad2) that steps since the last stance did not state
        self._owed = 0.0  # its part that was not removed
        self._refused = 0  # stances in a row
        self._stances: list[StanceHeadings] = []  # since the last step

    def add_belt(self, block: GyroBlock) -> None:
        """A block of samples, of which the belt's rate is used."""
        self._belt.add(block.t_s, block.belt)

    @property
    def trusted(self) -> bool:
        """Whether the foot's turns have confirmed the belt's turns."""
        return self._filter is not None and self._filter.trusted

    def corrected(self, event: Step | Stance) -> Step | Stance:
        """A step turned by the correction; a stance as it is, after it was measured."""
        if isinstance(event, Stance):
            self._measure(event)
            return event
        variance = event.heading_sd_rad**2
        self._growth += variance
        stated = math.sqrt((1.0 - self._share) * variance + self._owed)
        self._promised, self._owed = self._promised + self._share * variance, 0.0
        if self._filter is None:
            return event
        self.evidence = BeltEvidence(tuple(self._stances), self.correction_rad, event.heading_sd_rad)
        self._stances.clear()
        turned = rotated_event(event, self.correction_rad)
        assert isinstance(turned, Step)
        heading_rad = wrap(event.heading_rad - self.correction_rad) if self.correction_rad else event.heading_rad
        return replace(turned, heading_rad=heading_rad, heading_sd_rad=stated, toe_rad=event.toe_rad)

    def _measure(self, stance: Stance) -> None:
        """Foot and belt in a stance; the foot does not turn while it stands."""
        begin_s, end_s = stance.t_start_s + EDGE_S, stance.t_end_s - EDGE_S
        if end_s - begin_s < REST_S:
            self._measure_at(0.5 * (begin_s + end_s), stance.heading_rad)
            return
        self._measure_at(max(begin_s, min(self._belt.oldest_s, end_s)), stance.heading_rad)
        self._measure_at(end_s, stance.heading_rad, WALKING_RAD_S)

    def _measure_at(self, t_s: float, yaw_rad: float, bias_sd_rad_s: float = 0.0) -> None:
        """Foot and belt at a time; `bias_sd_rad_s`: how far the belt's bias has differed since the last measurement."""
        angle = self._belt.angle_rad(t_s)
        if angle is None:
            self._keep_foot()
            return
        known = self._growth < LOST_RAD**2
        joins = known and self._last is not None and self._belt.since_s <= self._last.t_s < t_s
        headings = StanceHeadings(t_s, yaw_rad, angle, self._growth, bias_sd_rad_s, begins=not joins)
        if not (joins and self._filter and self._last and self._correct(self._filter, headings, self._last)):
            self._keep_foot()
        if headings.begins or self._refused >= REFUSALS:
            headings = headings._replace(begins=True)
            self._filter, self._refused = HeadingFilter(headings), 0
        self._stances.append(headings)
        self._last, self._growth = headings, 0.0

    def _correct(self, known: HeadingFilter, headings: StanceHeadings, last: StanceHeadings) -> bool:
        """Correct the foot by the belt's share of its estimated error; False if the difference is beyond the gate."""
        dt = headings.t_s - last.t_s
        belt = known.belt_variance(dt, wrap(headings.foot_rad - last.foot_rad))
        share = headings.growth_rad2 / (headings.growth_rad2 + belt)
        if known.trusted and headings.growth_rad2 > 0.0:
            # Back to the foot over the time in which the error of the belt's bias makes as much drift as the foot has
            over_s = max(headings.growth_rad2 / (dt * float(known.P[BIAS, BIAS])), CORRELATED_S)
            self.correction_rad *= math.exp(-dt / over_s)
        known.propagate(headings, math.exp(-dt / RECENT_S))
        if not known.update(headings):
            self._refused += 1
            return False
        error_rad = float(known.state[FOOT])
        known.state[FOOT], known.state[OFFSET] = 0.0, known.state[OFFSET] + error_rad
        self._share = share if known.trusted else 0.0
        self.correction_rad = wrap(self.correction_rad + self._share * error_rad)
        self._refused, self._promised = 0, 0.0
        return True

    def _keep_foot(self) -> None:
        """The foot's turn stays uncorrected: the next step states the variance that was left out."""
        self._owed, self._promised, self._share = self._owed + self._promised, 0.0, 0.0
