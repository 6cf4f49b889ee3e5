# SPDX-License-Identifier: MIT
"""Zero-velocity inertial navigation of one foot, and the trunk's path that follows from it.

In: accelerations, rates and magnetic field of a foot-mounted IMU (sensor frame, SI). Out: `Step` and `Stance` (walk frame), and from them
`PathSegment`s of the trunk. Owns the state of the error-state Kalman filter.
"""

from echostep.foot.steps import Foot, FootSettings, Stance, Step, Track, walk_track

__all__ = ["Foot", "FootSettings", "Stance", "Step", "Track", "walk_track"]
