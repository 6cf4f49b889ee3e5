# SPDX-License-Identifier: MIT
"""A meeting with another wearer, and its evidence for the wearer's place.

In: the fields of a message. Out: `Meeting`, its covariance, a start from it alone. Owns nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from echostep.arrays import Floats
from echostep.localization.estimate import TAIL
from echostep.particles.ellipse import ellipse95
from echostep.particles.limits import LOST_M
from echostep.path import PathSegment
from echostep.ports.people.check_in import MOST_SD_M, CheckIn

# Assumed, not measured.
SIDE_SD_M = 0.6  # per axis, of the offset between two people side by side: an arm's length
MOVED_M_S = 1.0  # speed at which a teammate may have gone on since the report: a walk
WIDEST_M = 10.0  # 95 % radius of the wearer's place by a meeting, above which the meeting adds nothing to the plan
RANGE_BODY_SD_M = 0.1  # of a radio range: added by bodies and antennas
WRONG = {"tracking": 0.02, "uncertain": 0.2}  # probability that a meeting is wrong, by the teammate's status


@dataclass(frozen=True, slots=True)
class Meeting:
    """A meeting as the filter uses it: the fields of a `MeetingMessage`, and the displacement (walk frame) since the moment of the cloud.

    `share`: the power of its likelihood, 1 / number of meetings that rest on one measurement.
    """

    name: str
    status: str
    x_m: float
    y_m: float
    level: int
    xx_m2: float
    xy_m2: float
    yy_m2: float
    age_s: float = 0.0
    level_probability: float = 1.0
    range_m: float | None = None
    range_sd_m: float = 0.0
    beacon: int | None = None
    way_x_m: float = 0.0
    way_y_m: float = 0.0
    share: float = 1.0


TimedMeeting = tuple[float, Meeting]  # time (s) of a meeting, -inf if it is not known


def on_the_way(meeting: Meeting, segment: PathSegment, t_s: float) -> Meeting:
    """The meeting at this time with the displacement since the beginning of its segment; unchanged for an unobserved segment."""
    span_s = segment.t1_s - segment.t0_s
    if segment.unobserved or span_s <= 0.0:
        return meeting
    share = min(max((t_s - segment.t0_s) / span_s, 0.0), 1.0)
    return replace(meeting, way_x_m=share * segment.dx_m, way_y_m=share * segment.dy_m)


def carries_position(meeting: Meeting) -> bool:
    """Whether the teammate's place is known: its status is not lost, its 95 % radius is below LOST_M, and the report is not too old."""
    radius_m = ellipse95(meeting.xx_m2, meeting.xy_m2, meeting.yy_m2).major_m
    (xx, xy), (_, yy) = covariance(meeting).tolist()
    return meeting.status in WRONG and radius_m <= LOST_M and ellipse95(xx, xy, yy).major_m <= WIDEST_M


def covariance(meeting: Meeting) -> Floats:
    """Covariance (2, 2) of the wearer's place given the meeting (m2): the teammate's with heavier tails, its way since the report, the offset."""
    own = np.array([[meeting.xx_m2, meeting.xy_m2], [meeting.xy_m2, meeting.yy_m2]])
    offset_m2 = (MOVED_M_S * meeting.age_s) ** 2 + (SIDE_SD_M**2 if meeting.range_m is None else 0.0)
    return TAIL**2 * own + offset_m2 * np.eye(2)


def start_at(meeting: Meeting) -> CheckIn:
    """A start from a meeting alone: about the teammate, within the radio's range and the way until then, with any heading."""
    range_m = 0.0 if meeting.range_m is None else meeting.range_m
    way_m2 = meeting.way_x_m**2 + meeting.way_y_m**2
    sd_m = math.sqrt(0.5 * (float(np.trace(covariance(meeting))) + range_m**2 + way_m2))
    return CheckIn(meeting.x_m, meeting.y_m, None, min(max(sd_m, RANGE_BODY_SD_M), MOST_SD_M), meeting.level)
