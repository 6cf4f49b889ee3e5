# SPDX-License-Identifier: MIT
"""Speed beside peers: clouds weighed, moves that cross walls, plans of a city's size, and the whole step of [Girard 2011].

In: a `Scale`. Out: `Row`s. Owns nothing. Ours and the peer's see the same poses and walls, and their weights must agree; only the updates of other
filters have no map.
"""

from __future__ import annotations

import json
import math
import tempfile
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from statistics import median
from unittest import mock

import numpy as np
import shapely

from echostep.arrays import Floats
from echostep.jit import kernel
from echostep.plan import load_plan
from echostep.walls.echo_sources import Walls
from echostep.walls.index import WallIndex, build_index, crosses_wall
from echostep_studies.papers import girard2011
from echostep_studies.papers.girard2011_rays import lambda_ray_ranges
from echostep_studies.speed.comparison import Row, Scale, Work, compared
from echostep_studies.speed.peers import (
    APERTURE_RAD,
    MAPLESS,
    MAXIMUM_M,
    MISSING,
    RAYS,
    READERS,
    Reader,
    plain_rays,
)


def offices(count: int) -> Floats:
    """About `count` walls (n, 4): corridors 2.5 m wide, rooms of 4 m x 5 m and doors of 0.9 m on both sides, stacked to a block about square."""
    pairs = max(count // 8, 1)
    floors = max(round(math.sqrt(pairs * 4.0 / 12.5)), 1)
    x, y = np.meshgrid(4.0 * np.arange(math.ceil(pairs / floors)), 12.5 * np.arange(floors))
    origin = np.stack([x.ravel(), y.ravel(), x.ravel(), y.ravel()], -1)
    room = []
    for back, front in ((0.0, 5.0), (12.5, 7.5)):
        room += [[0, back, 4, back], [0, back, 0, front], [0, front, 1.5, front], [2.4, front, 4, front]]
    return (origin[:, None] + np.array(room, dtype=np.float64)).reshape(-1, 4)


def cloud(walls: Floats, count: int, seed: int = 1) -> tuple[Floats, Floats, Floats]:
    """A cloud of x, y, heading in the corridor in the middle of the walls: 2 m along, 1 m across, 8 degrees."""
    rng = np.random.default_rng(seed)
    x = 4.0 * round(walls[:, ::2].mean() / 4.0) + 2.0 * rng.standard_normal(count)
    y = 12.5 * math.floor(walls[:, 1::2].mean() / 12.5 - 0.25) + 6.25 + 1.0 * rng.standard_normal(count)
    return x, y, math.radians(8.0) * rng.standard_normal(count)


MEASURED_M = np.array([1.2, 1.4])
SLANT_RAD = 0.5 * APERTURE_RAD / RAYS


def weights(readings: Floats) -> Floats:
    """Weights of poses from what their rangers should read [Girard 2011, eq. 1]."""
    least = np.minimum(np.minimum(readings, MEASURED_M), MAXIMUM_M)
    return (least / np.minimum(np.maximum(readings, MEASURED_M), MAXIMUM_M)).mean(1)


def _read_weights(read: Reader, x: Floats, y: Floats, heading: Floats) -> Floats:
    return weights(read(x, y, heading))


def our_reading(owner: Walls, x: Floats, y: Floats, heading: Floats) -> Floats:
    """Weights of poses by the visible walls."""
    return our_weights(lambda_ray_ranges(x, y, heading, owner.near(x, y), RAYS, APERTURE_RAD, MAXIMUM_M))


@kernel
def our_weights(readings: Floats) -> Floats:
    """The same in one sweep."""
    out = np.empty(len(readings))
    for i in range(len(readings)):
        total = 0.0
        for k in range(2):
            least, most = min(readings[i, k], MEASURED_M[k]), max(readings[i, k], MEASURED_M[k])
            total += min(least, MAXIMUM_M) / min(most, MAXIMUM_M)
        out[i] = 0.5 * total
    return out


def weighing(scale: Scale) -> Iterator[Row]:
    """A cloud to weights, against rays; the readings must agree."""
    walls = offices(scale.office)
    x, y, heading = cloud(walls, scale.poses)
    owner = Walls(walls, SLANT_RAD)

    ours = partial(our_reading, owner, x, y, heading)
    expected = ours()
    for peer, (reader, wanted) in READERS.items():
        if peer in MISSING:
            continue
        read = reader(walls)
        agree = np.isclose(weights(read(x, y, heading)), expected, atol=1e-5).mean()
        if agree < 0.999:
            raise SystemExit(f"{peer}: only {agree:.2%} of the weights agree with ours")
        yield compared(
            f"weigh {len(x):,} poses; {peer}, {2 * RAYS} rays a pose",
            ours,
            partial(_read_weights, read, x, y, heading),
            scale.rounds,
            wanted,
        )


def crossing(scale: Scale) -> Iterator[Row]:
    """Which of many short moves cross a wall, against shapely's bulk query."""
    walls = offices(scale.office)
    x, y, heading = cloud(walls, scale.poses)
    index = build_index(walls)
    to_x, to_y = x + 0.07 * np.cos(heading), y + 0.07 * np.sin(heading)
    tree = shapely.STRtree(shapely.linestrings(walls.reshape(-1, 2, 2)))

    def peer() -> object:
        lines = shapely.linestrings(np.stack([np.stack([x, y], -1), np.stack([to_x, to_y], -1)], 1))
        return tree.query(lines, predicate="intersects")

    yield compared(
        f"{len(x):,} moves of 7 cm through walls?; shapely STRtree",
        lambda: crossings(x, y, to_x, to_y, index),
        peer,
        scale.rounds,
    )


@kernel
def crossings(x: Floats, y: Floats, to_x: Floats, to_y: Floats, index: WallIndex) -> int:
    """How many moves cross a wall."""
    count = 0
    for i in range(len(x)):
        count += crosses_wall(x[i], y[i], to_x[i], to_y[i], index)
    return count


def growing(scale: Scale) -> Iterator[Row]:
    """The same cloud in a plan of 100 walls and in one of a city's size; and opening that one."""
    work: list[Work] = []
    for walls in (offices(scale.city), offices(100)):
        work.append(partial(our_reading, Walls(walls, SLANT_RAD), *cloud(walls, scale.poses)))
    city = offices(scale.city)
    yield compared(
        f"weigh {scale.poses:,} poses among {len(city):,} walls; among 100", work[0], work[1], scale.rounds, 0.8
    )
    times = []
    for _ in range(min(scale.rounds, 5)):
        began = time.perf_counter()
        build_index(city)
        times.append(time.perf_counter() - began)
    yield Row(f"index of {len(city):,} walls; 2 s allowed", 2.0 / median(times), median(times), 2.0, 1.0)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "plan.json"
        level = {"name": "0", "height_m": 0, "walls": city.tolist(), "rooms": []}
        path.write_text(json.dumps({"echostep_plan": 1, "name": "city", "levels": [level]}))
        began = time.perf_counter()
        load_plan(path)
        took, bare = time.perf_counter() - began, _json_s(path)
        yield Row(f"plan.json of {len(city):,} walls; json.loads alone", bare / took, took, bare)


def _json_s(path: Path) -> float:
    began = time.perf_counter()
    json.loads(path.read_bytes())
    return time.perf_counter() - began


def stepping(scale: Scale) -> Iterator[Row]:
    """The whole step of [Girard 2011] with its map, against other filters' updates without one, and against itself with rays."""
    walls = offices(scale.office)
    x, y, _ = cloud(walls, 1)

    def stepper(candidates: int) -> Work:
        settings = girard2011.GirardSettings(nu=max(candidates // 20, 1))
        filter_ = girard2011.Girard(
            settings, (float(x[0]), 12.5 * (y[0] // 12.5) + 6.25), walls, np.random.default_rng(1)
        )
        ahead = [1.0]

        def step() -> object:
            ahead[0] = -ahead[0]
            return filter_.step(1.25 * ahead[0], 0.0, 0.0, (1.2, 1.3))

        for _ in range(6):
            step()
        return step

    for name, update in MAPLESS.items():
        if name not in MISSING:
            yield compared(
                f"step of {scale.candidates:,} candidates; update of {name}, no map",
                stepper(scale.candidates),
                update(scale.candidates),
                scale.rounds,
                2.0,
            )
    step = stepper(3000)

    def with_rays() -> object:
        with mock.patch("echostep_studies.papers.girard2011.lambda_ray_ranges", plain_rays):
            return step()

    yield compared("step at nu = 150; the same by our own plain rays", step, with_rays, scale.rounds, 10.0)
