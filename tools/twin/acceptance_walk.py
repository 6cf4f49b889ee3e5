# SPDX-License-Identifier: GPL-3.0-or-later
"""The twin walks the protocol of `echostep acceptance` in real time (`make twin CORRIDOR=20x2`).

In: the lengths of a corridor. Out: two ports, as `twin.run` has them; a line each time a point is reached. Owns both pseudo terminals, and how
long the wearer stands on a point. The walk begins when the board's port is opened.
"""

from __future__ import annotations

import argparse
import contextlib
import sys
from collections.abc import Sequence

import numpy as np

from echostep.plan import Plan
from echostep_app.session.acceptance.protocol import Point, Visit
from echostep_app.session.acceptance.survey import corridor
from echostep_simulation.people.walker import Person, Walk, Waypoint
from echostep_simulation.scenario import Scenario
from twin.run import PtyBoard, PtyMtx, announce, playing, until_interrupted, wait_for_opening

STOP_S = 1.5  # on a point that is visited standing; assumed
WEARER = Person(stand_s=10.0)  # at both ends: longer than the foot takes for its first position, and the guide's rest
NEAR_M, SAME_M = 0.5, 0.02  # a point is about here; the trunk is as near to it as it comes


def waypoints(points: Sequence[Point], visits: Sequence[Visit], plan: Plan) -> list[Waypoint]:
    """The way from visit to visit."""
    way: list[Waypoint] = []
    for visit in visits:
        point = points[visit.point]
        way.append((point.x_m, point.y_m, STOP_S if visit.standing else 0.0, plan.levels[point.level].height_m))
    return way


def times_s(walk: Walk, points: Sequence[Point], visits: Sequence[Visit]) -> list[float]:
    """When the trunk is nearest to the point of each visit, in their order: in the middle of the time for which it stays there."""
    times, begin = [], 0
    for visit in visits:
        point = points[visit.point]
        away_m = np.hypot(*(walk.trunk_m[begin:] - (point.x_m, point.y_m)).T)
        arrives = int((away_m < NEAR_M).argmax())
        leaves = arrives + int((away_m[arrives:] >= NEAR_M).argmax() or len(away_m) - arrives)
        nearest = arrives + np.flatnonzero(away_m[arrives:leaves] <= away_m[arrives:leaves].min() + SAME_M)
        times.append(float(walk.t_s[begin + int(nearest[len(nearest) // 2])]))
        begin += leaves
    return times


def play(text: str, rounds: int, seed: int) -> None:
    """Walk the protocol of a corridor once, or until the board's port is closed."""
    protocol, board, mtx = corridor(text), PtyBoard(), PtyMtx()
    plan, visits = protocol.plan(), protocol.visits(rounds)
    with contextlib.closing(board):
        scenario = Scenario(plan, waypoints(protocol.points, visits, plan), seed, board, WEARER)
        due = [*zip(times_s(scenario.walk, protocol.points, visits), visits, strict=True)]
        announce(f"acceptance --corridor {text} --rounds {rounds} --board {board.port} --mtx {mtx.port}",
                 "Press Enter there at each point. ", board=board.port, mtx=mtx.port)  # fmt: skip
        wait_for_opening(board, mtx)
        for now_s in playing(scenario, board, mtx):
            if not board.is_open:
                return
            while due and now_s >= due[0][0]:
                print(f"at point {protocol.points[due.pop(0)[1].point].name}", flush=True)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("corridor", metavar="LENGTHxWIDTH")
    parser.add_argument("--rounds", type=int, default=2)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    return until_interrupted(lambda: play(options.corridor, options.rounds, options.seed))


if __name__ == "__main__":
    sys.exit(main())
