"""What simulated rangers hear, effect by effect [Girard 2011, 2.6, Figures 1-5], and how well the tracker's likelihood expects it.

In: a seed. Out: rows, a picture of each effect, and on demand the settings that explain simulated pings best. The simulation and the likelihood share
nothing but the plan: one computes levels of sound from mirror images, the other has a handful of numbers.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from echostep.arrays import Floats
from echostep.evaluate.study import Row, console, print_table, write_json
from echostep.localization.echo_likelihood import EchoModel, EchoSettings, echo_model, log_echo
from echostep.simulation.people.marker_walk import lay_markers, walk_markers
from echostep.simulation.world.acoustics import PIPE_RADIUS_M, SRF02, directivity_db, rod_db
from echostep.simulation.world.echoes import echoes
from echostep.simulation.world.sites import angled, otb, thousand
from echostep.walls.echo_sources import MOST_SOURCES, Walls, echo_sources

TRIES = 200  # pings at each place
FITTED = ("sd_m", "slant_m", "rim_db", "soft_db", "edge_db", "corner_db", "stray")
UNIFORM = -math.log(6.0)  # log-density of a range of which nothing is known
WIDTH_M = 2.4  # of the corridor of Figure 5


@dataclass(frozen=True, slots=True)
class SimulatedEcho:
    """Pings of the left ranger: at `place` (what the picture has on its x axis) the pose (x, y, heading) and the ranges (k,), nan for none."""

    place: float
    pose: tuple[float, float, float]
    range_m: Floats


@dataclass(frozen=True, slots=True)
class Effect:
    """One effect: walls that are there, what was heard, and the walls that the plan has."""

    name: str
    axis: str
    plan: Floats
    heard: list[SimulatedEcho]


def evaluate_echoes(seed: int, json_path: Path | None, out: Path, *, fit: bool) -> None:
    """Draw every effect, print how well it is expected, and fit the settings when asked to."""
    from echostep.evaluate.echoes.pictures import draw_effects

    rng = np.random.default_rng([seed, 40])
    effects = [make(rng) for make in (incidence, near_and_far, oblique, limits, frames)]
    rows = [_row(effect) for effect in effects] + [_cone()] + _schedules(seed)
    print_table("Simulated pings, and how the likelihood expects them", rows, {
        "name": "effect", "pings": "pings", "heard": "heard", "log_p": "mean log p", "uniform": "of a uniform", "finding": "finding",
    })  # fmt: skip
    draw_effects(out / "figures1-5.png", effects)
    console.print(f"{out / 'figures1-5.png'}")
    if fit:
        rows += fitted(seed)
    if json_path is not None:
        write_json(json_path, "echoes", 1, seed, rows)


def incidence(rng: np.random.Generator) -> Effect:
    """A wall at 2 m, and the ranger turned away from it [Girard 2011, Figure 1]."""
    wall = np.array([[-10.0, 2.0, 10.0, 2.0]])
    poses = [(float(deg), (0.0, 0.0, math.radians(deg))) for deg in range(0, 52, 2)]
    return Effect("incidence", "angle between ranger and wall's normal, degrees", wall, _listen(wall, poses, rng))


def near_and_far(rng: np.random.Generator) -> Effect:
    """A post before a wall at 3 m: missed unless it is very near [Girard 2011, Figure 3a]."""
    wall = np.array([[-10.0, 3.0, 10.0, 3.0]])
    post = np.array([[0.0, 0.0, 0.0, 0.01]])  # no face toward the ranger: it echoes like a thin rod
    heard = []
    for y in np.arange(0.2, 2.9, 0.15).tolist():
        built = np.vstack([wall, post + [0.0, y, 0.0, y]])
        heard += _listen(built, [(y, (0.0, 0.0, 0.0))], rng)
    return Effect("near and far", "distance of a thin post before a wall at 3 m, m", wall, heard)


def oblique(rng: np.random.Generator) -> Effect:
    """Across a corridor ever more obliquely: the echo is lost, then comes back by two walls [Girard 2011, Figure 3b]."""
    walls = np.array([[-10.0, 1.0, 4.0, 1.0], [-10.0, -1.0, 4.0, -1.0], [4.0, -1.0, 4.0, 1.0]])
    poses = [(float(deg), (2.0, 0.0, -math.radians(deg))) for deg in range(0, 92, 3)]
    return Effect("oblique", "angle of the ranger to the corridor's normal, degrees", walls, _listen(walls, poses, rng))


def limits(rng: np.random.Generator) -> Effect:
    """A wall straight ahead from touching to 7 m: the minimum and the maximum range."""
    wall = np.array([[-10.0, 0.0, 10.0, 0.0]])
    poses = [
        (d, (0.0, -d, 0.0)) for d in np.concatenate([np.arange(0.04, 0.4, 0.04), np.arange(0.5, 7.0, 0.25)]).tolist()
    ]
    return Effect("limits", "distance of the wall, m", wall, _listen(wall, poses, rng))


def frames(rng: np.random.Generator) -> Effect:
    """Along a corridor with three open doors on one side [Girard 2011, Figures 4 and 5]."""
    y, walls, x = 0.5 * WIDTH_M, [], 0.0
    for door in (2.0, 5.0, 8.0):
        a, b = door - 0.45, door + 0.45
        walls += [(x, y, a, y), (a, y, a, y + 0.15), (b, y, b, y + 0.15)]
        x = b
    walls += [(x, y, 10.0, y), (0.0, -y, 10.0, -y), (0.0, y + 4.0, 10.0, y + 4.0)]
    plan = np.array(walls)
    poses = [(at, (at, 0.0, 0.0)) for at in np.arange(0.3, 9.7, 0.1).tolist()]
    return Effect("door frames", "way along the corridor, m", plan, _listen(plan, poses, rng))


def _listen(
    built: Floats, poses: list[tuple[float, tuple[float, float, float]]], rng: np.random.Generator
) -> list[SimulatedEcho]:
    """Many pings of the left ranger at each pose."""
    heard = []
    for place, (x, y, heading) in poses:
        trunk, look = np.tile([x, y], (TRIES, 1)), np.full(TRIES, heading)
        us = echoes(trunk, look, built, np.zeros(2), rng).own_us[:, 0].astype(float)
        heard.append(SimulatedEcho(place, (x, y, heading), np.where(us > 0, us * (0.5e-6 * SRF02.speed_m_s), np.nan)))
    return heard


def log_p(plan: Walls, pose: tuple[float, float, float], ranges_m: Floats, model: EchoModel) -> Floats:
    """What the likelihood says of ranges (n,) of the left ranger at a pose."""
    x, y, heading = pose
    away, off, kind = (np.empty(MOST_SOURCES) for _ in range(3))
    axis = heading + 0.5 * math.pi
    index = plan.near(np.array([x]), np.array([y]))
    count = echo_sources(x, y, axis, index, away, off, kind)
    return np.array([log_echo(0.0 if math.isnan(z) else z, count, away, off, kind, model) for z in ranges_m.tolist()])


def _row(effect: Effect) -> Row:
    plan, model = Walls(effect.plan), echo_model(EchoSettings())
    explained = np.concatenate([log_p(plan, h.pose, h.range_m, model) for h in effect.heard])
    ranges = np.concatenate([h.range_m for h in effect.heard])
    return {
        "name": effect.name,
        "pings": len(ranges),
        "heard": round(float(np.mean(~np.isnan(ranges))), 3),
        "log_p": round(float(explained.mean()), 3),
        "uniform": round(UNIFORM, 3),
        "finding": FINDINGS[effect.name](effect),
    }


def _half_heard(effect: Effect) -> str:
    share = np.array([np.mean(~np.isnan(h.range_m)) for h in effect.heard])
    lost = effect.heard[int(np.argmax(share < 0.5))].place
    return f"half of the echoes are lost at {lost:.0f} degrees"


def _post_heard(effect: Effect) -> str:
    near = [h.place for h in effect.heard if np.nanmedian(h.range_m) < h.place + 0.3]
    return f"a thin post is heard up to {max(near, default=0.0):.1f} m, the wall behind it at 3 m"


def _detour(effect: Effect) -> str:
    medians = [(h.place, float(np.nanmedian(h.range_m))) for h in effect.heard if np.mean(~np.isnan(h.range_m)) > 0.5]
    far = [(angle, z) for angle, z in medians if z > 1.2]
    if not far:
        return "no echo by two walls"
    return f"beyond {far[0][0]:.0f} degrees {far[0][1]:.1f} m are reported, the wall is at 1.0 m"


def _limits(effect: Effect) -> str:
    heard = [h for h in effect.heard if np.mean(~np.isnan(h.range_m)) > 0.5]
    return f"between {np.nanmin(heard[0].range_m):.2f} m and {heard[-1].place:.2f} m"


def _signature(effect: Effect) -> str:
    medians = np.array([np.nanmedian(h.range_m) for h in effect.heard])
    return f"an open door lengthens the range by {np.max(medians[medians < 2.5]) - np.min(medians):.2f} m before its frame is passed"


FINDINGS: dict[str, Callable[[Effect], str]] = {
    "incidence": _half_heard, "near and far": _post_heard, "oblique": _detour, "limits": _limits, "door frames": _signature,
}  # fmt: skip


def pipe_range_m(off_axis_rad: float) -> float:
    """Farthest distance at which the 55 mm pipe is heard half of the time [Girard 2011, Figure 2a]."""
    away = np.arange(0.05, 6.0, 0.01)
    heard = [rod_db(float(d), off_axis_rad, PIPE_RADIUS_M, SRF02) > SRF02.threshold_db for d in away]
    return float(away[int(np.argmin(heard)) - 1]) if heard[0] else 0.0


def _cone() -> Row:
    angles = np.radians(np.arange(0.0, 50.0, 0.1))
    level = np.array([directivity_db(float(a), SRF02.size) for a in angles])
    six = math.degrees(float(angles[int(np.argmax(level < -6.0))]))
    finding = f"-6 dB at {six:.1f} degrees; the pipe is heard to {pipe_range_m(0.0):.1f} m ahead, {pipe_range_m(math.radians(25.0)):.1f} m at 25"
    return {"name": "angular response", "finding": finding}


def _schedules(seed: int) -> list[Row]:
    """Pings answered by the other ranger's sound, in the paper's building, by schedule."""
    site, rows = otb(), []
    for name, offset_s in (("both at once", 0.0), ("concurrent", 0.033), ("sequential", 0.07)):
        pings = walk_markers(lay_markers(site.route), site.built, seed, offset_s=offset_s).pings
        share = float(np.mean(pings.cross))
        finding = f"{100 * share:.1f} % are the other ranger's sound; {len(pings.t_s) / pings.t_s[-1]:.0f} pings/s"
        rows.append({"name": f"schedule: {name}", "pings": len(pings.t_s), "finding": finding})
    return rows


def fitted(seed: int) -> list[Row]:
    """The settings that explain pings at true poses best, beside those in use: maximum likelihood over three simulated buildings."""
    from scipy.optimize import minimize

    seen = _at_true_poses(seed)
    start = np.log([getattr(EchoSettings(), name) for name in FITTED])

    def cost(x: Floats) -> float:
        chosen = dict(zip(FITTED, np.exp(x).tolist(), strict=True))
        if chosen["stray"] >= 0.95:
            return math.inf
        model = echo_model(replace(EchoSettings(), **chosen))
        return -float(np.mean([log_echo(z, n, d, off, kind, model) for z, n, d, off, kind in seen]))

    found = minimize(cost, start, method="Nelder-Mead", options={"maxfev": 400, "xatol": 0.02, "fatol": 1e-4})
    console.print(f"fit on {len(seen)} simulated pings: mean log p {-cost(start):.3f} as set, {-found.fun:.3f} fitted")
    rows: list[Row] = [
        {"name": f"fit: {name}", "set": getattr(EchoSettings(), name), "fitted": round(value, 4)}
        for name, value in zip(FITTED, np.exp(found.x).tolist(), strict=True)
    ]
    print_table("Echo settings", rows, {"name": "setting", "set": "as set", "fitted": "fitted"})
    return rows


def _at_true_poses(seed: int) -> list[tuple[float, int, Floats, Floats, Floats]]:
    seen = []
    for site in (otb(), angled(), thousand()):
        walk = walk_markers(lay_markers(site.route), site.built, 10_000 + seed)
        plan, p = Walls(site.plan), walk.pings
        for x, y, axis, z in zip(*p.pose.T.tolist(), p.range_m.tolist(), strict=True):
            away, off, kind = (np.empty(MOST_SOURCES) for _ in range(3))
            count = echo_sources(x, y, axis, plan.near(np.array([x]), np.array([y])), away, off, kind)
            seen.append((0.0 if math.isnan(z) else z, count, away, off, kind))
    return seen
