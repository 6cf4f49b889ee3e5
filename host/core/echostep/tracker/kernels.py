# SPDX-License-Identifier: MIT
"""The kernels of a run in parts, each a function that calls its kernels once, so that they are compiled; hardly any kernel is in two of them.

In: nothing. Out: kernels in the cache (`kernel_cache`), from which every process loads them. Owns nothing.
"""

from __future__ import annotations

from importlib.resources import as_file, files

import numpy as np

from echostep.aiding import AidedFilter
from echostep.board.frames import encode
from echostep.board.gateway import BeaconReading
from echostep.board.messages import Outcome, Ping
from echostep.foot.steps import walk_track
from echostep.localization import Building, MapFilter, Start
from echostep.odometry import FrontEnd
from echostep.path import MeasuredSegment, PathSegment
from echostep.plan import NO_PLAN, Plan, Pose, load_plan
from echostep.ports.chunks import BOARD, Chunk, portion_of
from echostep.settings import Settings
from echostep.walls.level_sheet import lay_out_levels
from echostep.xsens import reader

KNOWN, UNKNOWN = Start(Pose(0.0, 0.0, 0.0)), Start()


def walls() -> None:
    """Echoes from the walls of a plan."""
    _filter(_plan(), KNOWN)


def foot() -> None:
    """Navigation of the foot."""
    walk_track(np.zeros(1), np.zeros((1, 3)), np.zeros((1, 3)))


def board_and_clocks() -> None:
    """Bytes of board and MTx, and the times of their messages."""
    reader.warm_up()
    s = Settings()
    ping = Chunk(BOARD, 0, encode(Ping(0, 0, Outcome.ECHO, 5_000), 0))
    FrontEnd(s.mtx, s.ranger, s.foot, s.gait).process(portion_of([ping]))


def cloud() -> None:
    """Particles and their rangers' bias; without a plan, for its walls are another part."""
    _filter(NO_PLAN, KNOWN).update(measured())
    MapFilter.call_kernels()


def search() -> None:
    """The search of a whole building."""
    _filter(_plan(), UNKNOWN).update(measured())


def beacons() -> None:
    """Readings of radio beacons."""
    followed = _filter(_plan(), KNOWN)
    followed.update(measured(), [BeaconReading(t_s, 0, 0.5, 0.0) for t_s in (0.4, 0.6)])
    followed.beacon_map.places(followed.cloud, 1.0)


def _filter(plan: Plan, start: Start) -> AidedFilter:
    return AidedFilter(Building.of(plan, lay_out_levels(plan)), start, 0.0, np.random.default_rng(0))


def measured() -> MeasuredSegment:
    """A segment with a ping."""
    segment = PathSegment(0.0, 1.0, 0.01, 0.0, 0.0, 0.0, 0.01, 0.0, 0)
    return MeasuredSegment(segment, np.array([0.5]), np.array([0]), np.array([1.0]))


def _plan() -> Plan:
    with as_file(files("echostep") / "plans/demo.json") as path:
        return load_plan(path)
