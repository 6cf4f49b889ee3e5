# SPDX-License-Identifier: MIT
"""Odometry: bytes of board and MTx -> the trunk's path with the pings triggered on each segment.

In: `Portion`s of chunks. Out: `MeasuredSegment`s and `Dropout`s in order of time; samples and segments for a watch over the wearer.
Owns the readers, the timeline, the foot and leg odometry, and the pings and segments that wait for each other.
"""

from typing import TYPE_CHECKING

from echostep.additions import face

if TYPE_CHECKING:
    from echostep.odometry.foot_source import ICM20649_NOISE
    from echostep.odometry.front_end import FrontEnd, FrontEndCounts
    from echostep.odometry.heading_filter import FOOT, HeadingFilter
    from echostep.odometry.wearer import Alarm, AlarmKind, AlarmReason, WearerWatch

__getattr__ = face(__name__)
