# SPDX-License-Identifier: MIT
"""Compile the kernels of the pipeline before a parallel run begins: its workers would each compile all of them at the same time.

In: the name of one part. Out: numba's cache beside the sources. Owns the parts, which take about as long as each other and share no kernel.
"""

from __future__ import annotations

import sys
from unittest import mock

from board_runs import ROOT
from echostep.odometry.front_end import FrontEnd
from echostep.plan.model import load_plan
from echostep.tracker import Tracker
from walks import walk_chunks


def compile_front_end() -> None:
    """Simulation and front end, by one second of a walk."""
    walk_chunks(1.0)
    Tracker(load_plan(ROOT / "host/echostep/plans/demo.json")).front_end.warm_up()


def compile_filter() -> None:
    """Filter, walls and beacons: all of the tracker but the front end."""
    with mock.patch.object(FrontEnd, "warm_up"):
        Tracker(load_plan(ROOT / "host/echostep/plans/demo.json")).warm_up()


PARTS = {"front-end": compile_front_end, "filter": compile_filter}


if __name__ == "__main__":
    PARTS[sys.argv[1]]()
