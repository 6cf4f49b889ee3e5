# SPDX-License-Identifier: MIT
"""Where the pings of a segment were sent, while the tracker is believed.

In: a segment with its pings, the estimate at its end. Out: rows of pings with their poses. Owns nothing.
"""

from __future__ import annotations

import math

import numpy as np

from echostep.arrays import Floats
from echostep.localization import Estimate, TrackStatus
from echostep.path import MeasuredSegment


def placed_pings(measured: MeasuredSegment | None, estimate: Estimate) -> Floats:
    """Rows (k, 5): ranger, x and y in the map, axis, range; back from the estimate along the way in the walk frame.

    None unless the estimate is `tracking` and the way was observed.
    """
    if measured is None or estimate.status is not TrackStatus.TRACKING or measured.segment.unobserved:
        return np.zeros((0, 5))
    segment = measured.segment
    span_s = segment.t1_s - segment.t0_s
    share = np.clip((measured.t_s - segment.t0_s) / span_s, 0.0, 1.0) if span_s > 0.0 else np.ones(len(measured.t_s))
    way_x, way_y = segment.way_m(share)
    back_x, back_y = segment.dx_m - way_x, segment.dy_m - way_y
    turn = estimate.heading_rad - segment.heading1_rad
    c, s = math.cos(turn), math.sin(turn)
    x, y = estimate.x_m - (c * back_x - s * back_y), estimate.y_m - (s * back_x + c * back_y)
    axis = estimate.heading_rad - (1.0 - share) * segment.turn_rad + measured.off_heading_rad
    return np.column_stack([measured.ranger, x, y, axis, measured.range_m])
