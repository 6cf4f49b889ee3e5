# SPDX-License-Identifier: MIT
"""The walks of the study: simulated feet with the drift of real ones, passers-by before the rangers.

In: a site, a seed. Out: `SimulatedWalk`. Owns the drift. The simulated foot drifts by 0.3 degrees per square root of a metre; those of the surveyed
hallways of gx5_gcp by 0.15, 0.38 and 0.57, and their lengths are 0.1, 0.4 and 0.7 % long (headings by windows of six footprints). The drift arises in
the foot's MTx, so that the belt's gyro, worn as real ones are, can tell it.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from echostep.legs.trunk_path import rotated_segment
from echostep_simulation.devices.board_sensors import WornGyro
from echostep_simulation.devices.mtx import MtxModel
from echostep_studies.bench.echo_changes import with_people
from echostep_studies.bench.sites import Site
from echostep_studies.bench.walks import SimulatedWalk, simulate

# Random walk of the heading per square root of a metre: the worst of the hallways, with the simulated foot's own.
DRIFT_RAD = math.radians(0.5)
SCALE_SD = 0.007  # of all lengths of a walk: the worst of the hallways
PEOPLE = 0.05  # share of the time for which a person is beside a ranger


def walked(site: Site, seed: int) -> SimulatedWalk:
    """The walk of a site with drift and passers-by."""
    rng = np.random.default_rng([seed, 84])
    walk = simulate(site, seed, MtxModel(yaw_walk_rad=DRIFT_RAD), WornGyro())
    return with_people(_scaled(walk, 1.0 + SCALE_SD * rng.standard_normal()), PEOPLE, rng)


def _scaled(walk: SimulatedWalk, scale: float) -> SimulatedWalk:
    """The same path as a foot that measures all lengths too long by a factor."""
    return replace(
        walk, segments=tuple(replace(m, segment=rotated_segment(m.segment, 0.0, scale)) for m in walk.segments)
    )
