"""Speed, as ratios against a peer that does the same work in the same run on the same poses and walls.

In: nothing. Out: a table, and bench.json (`{name, ratio, median_s, peer_s}` a row) in the folder given by --out. Rounds of ours and the peer's are
interleaved, so that a busy machine slows both.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median

import numpy as np
import shapely
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from echostep.likelihoods import EchoSettings, echo_model
from echostep.particles import _propagate, _reweight
from echostep.walls import EAR_REACH_M, build_index

Floats = NDArray[np.float64]
POSES = 2_000
RAYS = 7


def office(rooms: int) -> Floats:
    """Walls (n, 4) of a corridor 2.5 m wide with rooms of 4 m x 5 m and doors of 0.9 m on both sides."""
    walls = [[0.0, 0.0, 0.0, 12.5], [4.0 * rooms, 0.0, 4.0 * rooms, 12.5]]
    for k in range(rooms):
        x = 4.0 * k
        for back, front in ((0.0, 5.0), (12.5, 7.5)):
            walls += [
                [x, back, x + 4, back],
                [x, back, x, front],
                [x, front, x + 1.5, front],
                [x + 2.4, front, x + 4, front],
            ]
    return np.array(walls)


def poses(rooms: int, rng: np.random.Generator) -> tuple[Floats, Floats, Floats]:
    """A cloud in the corridor: x, y, heading."""
    x = 2.0 * rooms + 2.0 * rng.standard_normal(POSES)
    return x, 6.25 + 0.4 * rng.standard_normal(POSES), 0.15 * rng.standard_normal(POSES)


def shapely_rays(x: Floats, y: Floats, heading: Floats, tree: shapely.STRtree, lines: Floats) -> Floats:
    """Distance along each of seven rays of the left ranger, the nearest hit: what a map library offers out of the box."""
    fan = np.linspace(-1, 1, RAYS) * math.radians(27.5) + math.pi / 2
    angle = (heading[:, None] + fan).ravel()
    start = np.column_stack([np.repeat(x, RAYS), np.repeat(y, RAYS)])
    end = start + EAR_REACH_M * np.column_stack([np.cos(angle), np.sin(angle)])
    rays = shapely.linestrings(np.stack([start, end], axis=1))
    ray, wall = tree.query(rays, predicate="intersects")
    nearest = np.full(len(rays), EAR_REACH_M)
    np.minimum.at(
        nearest, ray, shapely.distance(shapely.points(start[ray]), shapely.intersection(rays[ray], lines[wall]))
    )
    return nearest.reshape(-1, RAYS).min(1)


def interleaved(ours: Callable[[], object], peer: Callable[[], object], rounds: int) -> tuple[float, float]:
    """Median seconds of ours and of the peer's, taken in turn, after one round that is not counted."""
    times: tuple[list[float], list[float]] = ([], [])
    for k in range(rounds + 1):
        for side, work in enumerate((ours, peer)):
            began = time.perf_counter()
            work()
            if k:
                times[side].append(time.perf_counter() - began)
    return median(times[0]), median(times[1])


def rows(rounds: int) -> list[dict[str, float | str]]:
    """One row a comparison."""
    rng = np.random.default_rng(1)
    walls = office(60)
    index = build_index(walls)
    lines = shapely.linestrings(walls.reshape(-1, 2, 2))
    tree = shapely.STRtree(lines)
    x, y, heading = poses(60, rng)
    to_x, to_y = x + rng.normal(0, 0.5, POSES), y + rng.normal(0, 0.5, POSES)
    model = echo_model(EchoSettings())

    def weigh() -> None:
        _reweight(x, y, heading, np.zeros(POSES), math.pi / 2, 1.2, 1.0, model, index)

    still, noise = np.zeros(POSES), np.vstack([to_x - x, to_y - y, np.zeros(POSES)])

    def cross() -> None:
        _propagate(x.copy(), y.copy(), still, still, np.zeros(POSES), 0.0, 0.0, noise, index)

    def shapely_cross() -> None:
        moves = shapely.linestrings(np.stack([np.column_stack([x, y]), np.column_stack([to_x, to_y])], axis=1))
        tree.query(moves, predicate="intersects")

    pairs = [
        (
            "weigh a cloud by one echo, peer: shapely STRtree rays",
            weigh,
            lambda: shapely_rays(x, y, heading, tree, lines),
        ),
        ("move a cloud and see which particles cross a wall, peer: shapely STRtree", cross, shapely_cross),
    ]
    found: list[dict[str, float | str]] = []
    for name, ours, peer in pairs:
        own_s, peer_s = interleaved(ours, peer, rounds)
        found.append({"name": name, "ratio": peer_s / own_s, "median_s": own_s, "peer_s": peer_s})
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--out", type=Path, default=Path("out/bench"), metavar="DIR")
    parser.add_argument("--rounds", type=int, default=9)
    options = parser.parse_args()
    found = rows(options.rounds)
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / "bench.json").write_text(json.dumps(found, indent=1) + "\n")
    table = Table("what", "ours", "peer", "ratio", title=f"{POSES} poses, {len(office(60))} walls, medians")
    for row in found:
        table.add_row(
            str(row["name"]), *(f"{1e3 * float(row[k]):.2f} ms" for k in ("median_s", "peer_s")), f"{row['ratio']:.0f}x"
        )
    Console().print(table)


if __name__ == "__main__":
    main()
