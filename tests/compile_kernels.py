# SPDX-License-Identifier: MIT
"""Compile the kernels of the pipeline before a parallel run begins: its workers would each compile all of them at the same time.

In: the name of one part. Out: numba's cache beside the sources. Owns the parts, which take about as long as each other and share no kernel.
"""

from __future__ import annotations

import sys
from unittest import mock

import numpy as np

from board_runs import ROOT
from echostep.odometry.front_end import FrontEnd
from echostep.plan.model import load_plan
from echostep.tracker import Tracker
from echostep_studies.barometer.altitude import Altitude, Pressures
from echostep_studies.barometer.floor_filter import FloorFilter
from walks import walk_chunks


def compile_front_end() -> None:
    """Simulation and front end, by one second of a walk."""
    walk_chunks(1.0)
    Tracker(load_plan(ROOT / "host/echostep/plans/demo.json")).front_end.warm_up()


def compile_filter() -> None:
    """Filter, walls and beacons: all of the tracker but the front end."""
    with mock.patch.object(FrontEnd, "warm_up"):
        Tracker(load_plan(ROOT / "host/echostep/plans/demo.json")).warm_up()


def compile_heights() -> None:
    """The filters of a barometer's record, by a minute on one floor."""
    samples = Pressures(np.arange(60.0), np.full(60, 101_325.0))
    Altitude().feed(samples)
    FloorFilter(np.array([0.0, 3.5])).smooth(samples)


PARTS = {"front-end": compile_front_end, "filter": compile_filter, "heights": compile_heights}


if __name__ == "__main__":
    PARTS[sys.argv[1]]()
