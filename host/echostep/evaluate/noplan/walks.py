# SPDX-License-Identifier: MIT
"""The walks of the study: simulated feet with the drift of real ones, passers-by before the rangers.

In: a site, a seed. Out: `SimulatedWalk`. Owns the drift. The simulated foot drifts by 0.3 degrees per square root of a metre; those of the surveyed
hallways of gx5_gcp by 0.15, 0.38 and 0.57, and their lengths are 0.1, 0.4 and 0.7 % long (headings by windows of six footprints).
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from echostep.evaluate.anywhere.echo_changes import with_people
from echostep.evaluate.anywhere.sites import Site
from echostep.evaluate.anywhere.walks import SimulatedWalk, simulate
from echostep.path import MeasuredSegment

DRIFT_RAD = math.radians(
    0.5
)  # random walk of the heading, per square root of a metre: the worst of the hallways, with the simulated foot's own
SCALE_SD = 0.007  # of all lengths of a walk: the worst of the hallways
PEOPLE = 0.05  # share of the time for which a person is beside a ranger


def walked(site: Site, seed: int) -> SimulatedWalk:
    """The walk of a site with drift and passers-by."""
    rng = np.random.default_rng([seed, 84])
    return with_people(_drifting(simulate(site, seed), rng), PEOPLE, rng)


def _drifting(walk: SimulatedWalk, rng: np.random.Generator) -> SimulatedWalk:
    """The same path as a foot with more drift measures it."""
    scale, turned, segments = 1.0 + SCALE_SD * rng.standard_normal(), 0.0, []
    for measured in walk.segments:
        s = measured.segment
        turn = DRIFT_RAD * math.sqrt(math.hypot(s.dx_m, s.dy_m)) * rng.standard_normal()
        segments.append(_turned(measured, scale, turned, turn))
        turned += turn
    return replace(walk, segments=tuple(segments))


def _turned(measured: MeasuredSegment, scale: float, by_rad: float, turn_rad: float) -> MeasuredSegment:
    """A segment longer by `scale`, turned by `by_rad` at its beginning and `turn_rad` more at its end."""
    s, middle = measured.segment, by_rad + 0.5 * turn_rad
    c, sn = scale * math.cos(middle), scale * math.sin(middle)
    moved = replace(
        s,
        dx_m=c * s.dx_m - sn * s.dy_m,
        dy_m=sn * s.dx_m + c * s.dy_m,
        heading0_rad=s.heading0_rad + by_rad,
        heading1_rad=s.heading1_rad + by_rad + turn_rad,
    )
    return replace(measured, segment=moved)
