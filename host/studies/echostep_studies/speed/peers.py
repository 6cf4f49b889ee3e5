# SPDX-License-Identifier: MIT
"""What others offer for the same work, for `bench.py`: rays of embreex and shapely, plain rays, and updates without a map.

In: walls (n, 4), poses (n,). Out: functions to be timed. Owns nothing. Peers that are not installed are missing from the dictionaries;
`pip install 'host/studies[bench]'` brings them.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from echostep.arrays import Floats
from echostep.jit import kernel, part
from echostep.walls.index import TILE_M, WallIndex, build_index, tile_at

Reader = Callable[[Floats, Floats, Floats], Floats]  # poses -> what each ranger reads (n, 2)

RAYS, APERTURE_RAD, MAXIMUM_M = 7, math.radians(55.0), 6.0
MISSING = {
    name: f"{name} is not installed: {why}"
    for name, why in {
        "embreex": "pip install 'host/studies[bench]'",
        "filterpy": "pip install 'host/studies[bench]'",
        "stonesoup": "pip install 'host/studies[bench]'",
        "particles": "it needs numpy < 2, we are tested with numpy 2",
    }.items()
    if find_spec(name) is None
}


def fans(heading: Floats) -> Floats:
    """Angles (n, 2, RAYS) of the rays of both rangers."""
    fan = ((np.arange(RAYS) + 0.5) / RAYS - 0.5) * APERTURE_RAD
    axes = np.array([0.5 * math.pi, -0.5 * math.pi])
    return heading[:, None, None] + axes[:, None] + fan


def reading(hit_m: Floats, wall: NDArray[Any], angle: Floats, walls: Floats) -> Floats:
    """From where rays (n, 2, RAYS) end to readings (n, 2) [Girard 2011, eq. 3]; `wall` is -1 where none was met."""
    along = np.arctan2(walls[:, 3] - walls[:, 1], walls[:, 2] - walls[:, 0])
    slant = np.abs(np.sin(angle - along[wall]))
    counts = (wall >= 0) & (hit_m < MAXIMUM_M) & (slant >= math.cos(0.5 * APERTURE_RAD / RAYS))
    return np.where(counts, hit_m, MAXIMUM_M).min(-1)


def embreex_reader(walls: Floats) -> Reader:
    """Intel Embree: the walls as two triangles each, all rays in one call."""
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    a, b = np.c_[walls[:, :2], -np.ones(len(walls))], np.c_[walls[:, 2:], -np.ones(len(walls))]
    up = np.array([0.0, 0.0, 2.0])
    scene = EmbreeScene()
    TriangleMesh(
        scene, np.concatenate([np.stack([a, b, b + up], 1), np.stack([a, b + up, a + up], 1)]).astype(np.float32)
    )

    def read(x: Floats, y: Floats, heading: Floats) -> Floats:
        angle = fans(heading)
        each = angle[0].size
        ways = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], -1).reshape(-1, 3).astype(np.float32)
        origins = np.repeat(np.stack([x, y, np.zeros_like(x)], -1), each, axis=0).astype(np.float32)
        hit = scene.run(origins, ways, output=1)
        wall = np.where(hit["primID"] >= 0, hit["primID"] % len(walls), -1).reshape(angle.shape)
        return reading(hit["tfar"].reshape(angle.shape), wall, angle, walls)

    return read


def shapely_reader(walls: Floats) -> Reader:
    """shapely: rays as line strings, an STRtree over the walls, the nearest intersection."""
    lines = shapely.linestrings(walls.reshape(-1, 2, 2))
    tree = shapely.STRtree(lines)

    def read(x: Floats, y: Floats, heading: Floats) -> Floats:
        angle = fans(heading)
        start = np.repeat(np.stack([x, y], -1), angle[0].size, axis=0)
        end = start + MAXIMUM_M * np.stack([np.cos(angle), np.sin(angle)], -1).reshape(-1, 2)
        rays = shapely.linestrings(np.stack([start, end], 1))
        ray, wall = tree.query(rays, predicate="intersects")
        distance = shapely.distance(shapely.points(start[ray]), shapely.intersection(rays[ray], lines[wall]))
        order = np.lexsort((distance, ray))
        ray, first = np.unique(ray[order], return_index=True)
        nearest, met = np.full(len(rays), np.inf), np.full(len(rays), -1)
        nearest[ray], met[ray] = distance[order][first], wall[order][first]
        return reading(nearest.reshape(angle.shape), met.reshape(angle.shape), angle, walls)

    return read


def plain_reader(walls: Floats) -> Reader:
    """Our own reference."""
    index = build_index(walls)
    return lambda x, y, heading: plain_rays(x, y, heading, index)


@kernel
def plain_rays(
    x: Floats, y: Floats, heading: Floats, index: WallIndex,
    rays: int = RAYS, aperture_rad: float = APERTURE_RAD, maximum_m: float = MAXIMUM_M,
) -> Floats:  # fmt: skip
    """The same readings by rays that walk through the tiles [Amanatides, Woo 1987]."""
    out = np.full((len(x), 2), maximum_m)
    least = math.cos(0.5 * aperture_rad / rays)
    for i in range(len(x)):
        for ranger in range(2):
            for k in range(rays):
                angle = heading[i] + (0.5 - ranger) * math.pi + ((k + 0.5) / rays - 0.5) * aperture_rad
                length, square = _first_hit(x[i], y[i], math.cos(angle), math.sin(angle), index, out[i, ranger])
                if square >= least:
                    out[i, ranger] = length
    return out


@part
def _first_hit(px: float, py: float, ux: float, uy: float, index: WallIndex, limit: float) -> tuple[float, float]:
    """Distance of the first wall on a ray, and the cosine between the ray and its normal (-1: none within `limit`)."""
    walls, start, ids = index.walls, index.start, index.ids
    best, square, entered = limit, -1.0, 0.0
    while entered < best:
        x, y = px + (entered + 1e-9) * ux, py + (entered + 1e-9) * uy
        tile = tile_at(x, y, index)
        if tile < 0:
            break
        for j in range(start[tile], start[tile + 1]):
            w = ids[j]
            ax, ay, vx, vy = walls[w, 0], walls[w, 1], walls[w, 2] - walls[w, 0], walls[w, 3] - walls[w, 1]
            across = ux * vy - uy * vx
            if across == 0.0:
                continue
            length = ((ax - px) * vy - (ay - py) * vx) / across
            place = ((ax - px) * uy - (ay - py) * ux) / across
            if 0.0 <= place <= 1.0 and 0.0 < length < best:
                best, square = length, abs(across) / math.sqrt(vx * vx + vy * vy)
        column, row = tile % index.columns, tile // index.columns
        to_x, to_y = np.inf, np.inf
        if ux != 0.0:
            to_x = (index.x0_m + (column + (1 if ux > 0.0 else 0)) * TILE_M - px) / ux
        if uy != 0.0:
            to_y = (index.y0_m + (row + (1 if uy > 0.0 else 0)) * TILE_M - py) / uy
        entered = max(min(to_x, to_y), entered + 1e-9)
    return best, square


def filterpy_update(count: int) -> Callable[[], object]:
    """filterpy: move, weigh by two distances, resample, average; numpy does the first two, as its book shows."""
    from filterpy.monte_carlo import systematic_resample

    rng = np.random.default_rng(1)
    cloud = {"p": rng.normal(0, 1, (count, 3)), "w": np.full(count, 1.0 / count)}

    def update() -> object:
        p, w = cloud["p"], cloud["w"]
        p[:, 2] += 0.02 * rng.standard_normal(count)
        step = 1.25 + 0.25 * rng.standard_normal(count)
        p[:, 0] += np.cos(p[:, 2]) * step
        p[:, 1] += np.sin(p[:, 2]) * step
        p[:, :2] -= p[:, :2].mean(0)
        for z in (1.0, 1.2):
            w *= np.exp(-0.5 * ((np.hypot(p[:, 0], p[:, 1]) - z) / 0.5) ** 2)
        w += 1e-300
        w /= w.sum()
        chosen = systematic_resample(w)
        cloud["p"], cloud["w"] = p[chosen], np.full(count, 1.0 / count)
        return np.average(p, weights=w, axis=0)

    return update


def stonesoup_update(count: int) -> Callable[[], object]:
    """Stone Soup: bootstrap filter, constant velocity in the plane, one position fix, systematic resampling."""
    from datetime import datetime, timedelta

    from stonesoup.models.measurement.linear import LinearGaussian
    from stonesoup.models.transition.linear import CombinedLinearGaussianTransitionModel, ConstantVelocity
    from stonesoup.predictor.particle import ParticlePredictor
    from stonesoup.resampler.particle import SystematicResampler
    from stonesoup.types.detection import Detection
    from stonesoup.types.hypothesis import SingleHypothesis
    from stonesoup.types.state import ParticleState, StateVectors
    from stonesoup.updater.particle import ParticleUpdater

    walk = CombinedLinearGaussianTransitionModel([ConstantVelocity(0.1), ConstantVelocity(0.1)])
    fix = LinearGaussian(4, (0, 2), np.diag([0.25, 0.25]))
    predictor, updater = ParticlePredictor(walk), ParticleUpdater(fix, SystematicResampler())
    began = datetime(2011, 1, 1)
    states = np.random.default_rng(1).normal(0, 1, (4, count))
    prior = ParticleState(StateVectors(states), weight=np.full(count, 1.0 / count), timestamp=began)

    def update() -> object:
        then = began + timedelta(seconds=1)
        seen = Detection(np.zeros((2, 1)), timestamp=then, measurement_model=fix)
        return updater.update(SingleHypothesis(predictor.predict(prior, timestamp=then), seen)).mean

    return update


def particles_update(count: int) -> Callable[[], object]:
    """particles: one step of its bootstrap filter on a random walk in the plane, seen with noise."""
    import particles
    from particles import distributions
    from particles import state_space_models as ssm

    class PeerWalk(ssm.StateSpaceModel):  # type: ignore[misc]
        def PX0(self) -> Any:  # noqa: N802
            return distributions.IndepProd(distributions.Normal(), distributions.Normal())

        def PX(self, t: int, xp: Any) -> Any:  # noqa: ARG002, N802
            return distributions.IndepProd(*(distributions.Normal(loc=xp[:, k], scale=0.25) for k in range(2)))

        def PY(self, t: int, xp: Any, x: Any) -> Any:  # noqa: ARG002, N802
            return distributions.IndepProd(*(distributions.Normal(loc=x[:, k], scale=0.5) for k in range(2)))

    feynman_kac = ssm.Bootstrap(ssm=PeerWalk(), data=np.zeros((10_000, 2)))
    filter_ = particles.SMC(fk=feynman_kac, N=count, resampling="systematic", ESSrmin=1.0)
    return lambda: next(filter_)


# By name: what makes the reader of a plan's walls, and how many times longer it must take; what makes the update of a filter of so many candidates
READERS: dict[str, tuple[Callable[[Floats], Reader], float | None]] = {
    "shapely STRtree": (shapely_reader, 1000.0),
    "embreex": (embreex_reader, 15.0),
    "our own plain rays": (plain_reader, None),
}
MAPLESS: dict[str, Callable[[int], Callable[[], object]]] = {
    "filterpy": filterpy_update,
    "stonesoup": stonesoup_update,
    "particles": particles_update,
}
