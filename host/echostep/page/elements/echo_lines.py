"""Beams: what both rangers heard last, beside what the plan would have them hear.

In: a passage, the estimate at its end, the walls. Out: `Beam`s in the map. Owns nothing; looks at no tile that the cloud has not reached.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from echostep.angles import wrap
from echostep.jit import kernel
from echostep.localization.echo_likelihood import EchoModel, detection
from echostep.localization.estimate import Estimate
from echostep.localization.map_filter import RANGER_AXES_RAD
from echostep.path import MeasuredSegment
from echostep.walls.echo_sources import MOST_SOURCES, echo_sources
from echostep.walls.index import WallIndex


@dataclass(frozen=True, slots=True)
class Beam:
    """A ping sent at `t_s` from (x_m, y_m) along `axis_rad` of the map; None: no echo came, or none is expected."""

    t_s: float
    ranger: int
    x_m: float
    y_m: float
    axis_rad: float
    measured_m: float | None
    expected_m: float | None


def beams(
    passage: MeasuredSegment, told: Estimate, east_m: float, index: WallIndex, model: EchoModel
) -> tuple[Beam, ...]:
    """The last ping of each ranger on a passage, placed where the estimate says that the trunk was then.

    `east_m`: how far east of the map its level lies on the walls' sheet.
    """
    leg, found = passage.segment, []
    turn = told.heading_rad - leg.heading1_rad
    span_s = leg.t1_s - leg.t0_s
    for ranger in (0, 1):
        mine = np.flatnonzero(passage.ranger == ranger)
        if not len(mine):
            continue
        ping_s, range_m = float(passage.t_s[mine[-1]]), float(passage.range_m[mine[-1]])
        share = min(max((ping_s - leg.t0_s) / span_s, 0.0), 1.0) if span_s > 0.0 else 1.0
        heading = leg.heading0_rad + share * float(wrap(leg.heading1_rad - leg.heading0_rad))
        axis = turn + heading + float(RANGER_AXES_RAD[ranger])
        back, c, s = share - 1.0, math.cos(turn), math.sin(turn)
        x = told.x_m + back * (c * leg.dx_m - s * leg.dy_m)
        y = told.y_m + back * (s * leg.dx_m + c * leg.dy_m)
        expected = expected_range(x + east_m, y, axis, index, model)
        found.append(
            Beam(ping_s, ranger, x, y, axis, *(None if math.isnan(v) else float(v) for v in (range_m, expected)))
        )
    return tuple(found)


@kernel
def expected_range(x: float, y: float, axis_rad: float, index: WallIndex, model: EchoModel) -> float:
    """Range of the likeliest first echo at a pose, NaN when silence is likelier."""
    distance_m, off_axis_rad, kind = np.empty(MOST_SOURCES), np.empty(MOST_SOURCES), np.empty(MOST_SOURCES)
    count = echo_sources(x, y, axis_rad, index, distance_m, off_axis_rad, kind)
    unheard, best, range_m = 1.0, 0.0, np.nan
    for k in range(count):
        heard = unheard * detection(distance_m[k], off_axis_rad[k], kind[k], model)
        unheard -= heard
        if heard > best:
            best, range_m = heard, distance_m[k]
    return range_m if best > unheard else np.nan
