# SPDX-License-Identifier: MIT
"""Buildings of several levels: the sheet, heights of particles, and whole walks by stairs and lift."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from itertools import takewhile

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapely import Point, Polygon

from echostep.arrays import Floats
from echostep.board import messages as m
from echostep.height.levels import ClimbSettings, HeightArrays, HeightChange, change_levels, level_change_model
from echostep.localization import CloudSettings, Estimate, Start, TrackStatus
from echostep.localization.particles.cloud import Cloud, cloud_about
from echostep.particles.arrays import Move, ParticleArrays
from echostep.plan import ANY_LEVEL, Connector, Level, Plan, Pose
from echostep.ports.chunks import MTX, Chunk, portion_of
from echostep.tracker import Tracker
from echostep.walls.level_sheet import LevelSheet, connector_at, lay_out_levels, level_of, level_sheet_of, nearest_level
from echostep_simulation.devices.board import PythonBoard
from echostep_simulation.people.walker import Person, Waypoint, walk
from echostep_simulation.scenario import Scenario
from echostep_simulation.world.tower import LIFT_AT, STOREY_M, tour, tower


def tracked(
    plan: Plan, waypoints: list[Waypoint], seed: int, start: Pose | None = None
) -> tuple[Scenario, list[Estimate]]:
    scenario = Scenario(plan, waypoints, seed, PythonBoard(seed))
    chunks = list(scenario.chunks())
    tracker = Tracker(plan, start or scenario.start, seed=seed)
    return scenario, [e for k in range(0, len(chunks), 1000) for e in tracker.take(portion_of(chunks[k : k + 1000]))]


@cache
def up_and_down() -> tuple[Scenario, list[Estimate]]:
    return tracked(tower(3), tour(3), seed=1)


def off(scenario: Scenario, estimates: list[Estimate]) -> tuple[Floats, Floats]:
    """Horizontal error, and the true height, of each estimate."""
    truth, t_s = scenario.truth, [e.t_s for e in estimates]
    x, y, z = (np.interp(t_s, truth[:, 0], truth[:, k]) for k in (1, 2, 4))
    return np.hypot(x - [e.x_m for e in estimates], y - [e.y_m for e in estimates]), z


def between(z: float) -> bool:
    """Whether a height is more than half a metre from every floor."""
    return abs(z - STOREY_M * round(z / STOREY_M)) > 0.5


# The sheet


def test_each_level_lies_out_of_reach_of_the_others() -> None:
    plan = tower(3)
    sheet = lay_out_levels(plan)
    for k, level in enumerate(plan.levels):
        x = level.solid[:, [0, 2]].ravel() + k * sheet.sheet.pitch_m
        assert (level_of(x, sheet.sheet) == k).all()
    assert sheet.sheet.pitch_m > np.ptp(plan.levels[0].solid[:, [0, 2]]) + 50.0


def test_a_single_level_lies_where_its_map_has_it() -> None:
    plan = replace(tower(1), connectors=())
    walls = lay_out_levels(plan).walls.near(np.zeros(1), np.zeros(1)).walls
    assert np.array_equal(walls, plan.levels[0].solid)


@given(
    st.lists(st.tuples(st.integers(-20, 20), st.integers(-20, 20)), min_size=3, max_size=7, unique=True),
    st.integers(0, 999),
)
def test_a_connector_holds_what_its_polygon_holds(corners: list[tuple[int, int]], seed: int) -> None:
    polygon = Polygon(corners)
    if not polygon.is_valid:
        return
    outline = np.array(corners, float)
    plan = Plan("p", (Level("0", 0.0, np.zeros((0, 4))),) * 2, None, "", (Connector("lift", "l", (0, 1), outline),))
    storeys = level_sheet_of(plan)
    for x, y in np.random.default_rng(seed).uniform(-21.0, 21.0, (20, 2)).tolist():
        assert (connector_at(x, y, 0, storeys) == 0) == polygon.contains(Point(x, y))


def test_a_lift_stops_only_where_it_serves() -> None:
    levels = tuple(Level(str(k), 3.0 * k, np.zeros((0, 4))) for k in range(4))
    storeys = level_sheet_of(Plan("p", levels, None, "", (Connector("lift", "l", (0, 2), np.eye(3, 2)),)))
    assert [nearest_level(z, 0, storeys) for z in (-1.0, 1.4, 3.1, 9.0)] == [0, 0, 2, 2]
    assert connector_at(0.3, 0.3, 1, storeys) == -1


# Heights


def naive_climb(
    particle: Floats, move: Move, rise: HeightChange, variance: float, s: ClimbSettings, plan: Plan, storeys: LevelSheet,
) -> tuple[float, float, float, float]:  # fmt: skip
    """x, z, lag and what the log-weight gains of one particle without noise, the obvious way; as the docstring of `climbing` tells."""
    x, y, turn, scale, z, lag = particle.tolist()
    level = int(np.clip((x - storeys.x0_m) // storeys.pitch_m, 0, len(plan.levels) - 1))
    here = np.array([x - level * storeys.pitch_m, y])
    gone = scale * np.array(
        [
            math.cos(turn) * move.dx_m - math.sin(turn) * move.dy_m,
            math.sin(turn) * move.dx_m + math.cos(turn) * move.dy_m,
        ]
    )
    holds = [
        next(
            (
                c
                for c in plan.connectors
                if level in c.levels and Polygon(c.outline_m).contains(Point(here - part * gone))
            ),
            None,
        )
        for part in (0.0, 0.5, 1.0)
    ]
    connector = next((c for c in holds if c), None)
    gain, height = 0.0, rise.height_m
    if connector is not None:
        ends = [plan.levels[k].height_m for k in connector.levels]
        low, high = min(ends) - s.landing_sd_m, max(ends) + s.landing_sd_m
        if connector.kind != "lift":
            z += rise.felt_m
            beyond = z - float(np.clip(z, low, high))
            gain -= min(0.5 * beyond**2 / (s.flat_sd_m**2 + rise.felt_sd_m**2), s.unlikely)
            z -= beyond
        elif math.isfinite(rise.height_sd_m):
            height = rise.riding_m
            z = float(np.clip(height - lag, low, high))
        level = min(connector.levels, key=lambda k: abs(plan.levels[k].height_m - z))
    else:
        gain -= min(0.5 * rise.felt_m**2 / (s.flat_sd_m**2 + rise.felt_sd_m**2), s.unlikely)
    if holds[0] is None:
        gain -= min(0.5 * ((z - plan.levels[level].height_m) / s.landing_sd_m) ** 2, s.unlikely)
        z = plan.levels[level].height_m
    if math.isfinite(rise.height_sd_m):
        spread = variance + rise.height_sd_m**2
        wrong = height - z - lag
        gain -= min(2.0 * math.log(1.0 + wrong**2 / (3.0 * spread)), s.unlikely)
        lag += variance / spread * wrong if wrong**2 < 9.0 * spread else 0.0
    return here[0] + level * storeys.pitch_m, z, lag, gain


@pytest.mark.parametrize("height_sd_m", [0.2, math.inf])
@pytest.mark.parametrize("felt_m", [0.0, 0.34, -0.34])
def test_heights_are_those_of_the_obvious_way(felt_m: float, height_sd_m: float) -> None:
    plan = tower(3)
    storeys, s, rng, n = level_sheet_of(plan), ClimbSettings(), np.random.default_rng(5), 300
    level = rng.integers(0, 3, n)
    x = np.where(rng.random(n) < 0.5, rng.uniform(-6.0, 2.0, n), rng.uniform(29.0, 33.0, n)) + level * storeys.pitch_m
    y, turn, scale = rng.uniform(0.0, 3.0, n), rng.uniform(-3.0, 3.0, n), rng.normal(1.0, 0.02, n)
    z, lag, log_weight = level * STOREY_M + rng.normal(0.0, 0.8, n), rng.normal(0.0, 0.5, n), rng.normal(-1.0, 0.3, n)
    move, rise = Move(0.6, 0.1, 0.02, 0.01), HeightChange(felt_m, 0.0, 4.0, height_sd_m, 4.2, 1.0)
    particles = np.column_stack([x, y, turn, scale, z, lag])
    wanted = [naive_climb(row, move, rise, 0.3, s, plan, storeys) for row in particles]
    weights = log_weight + [row[3] for row in wanted]
    cloud, heights = ParticleArrays(x, y, turn, scale, log_weight), HeightArrays(z, lag)
    variance, _ = change_levels(cloud, heights, move, np.zeros(n), rise, 0.3, level_change_model(s), storeys)
    np.testing.assert_allclose(np.column_stack([x, z, lag]), np.array(wanted)[:, :3], rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(log_weight, weights - weights.max(), rtol=0.0, atol=1e-9)
    assert variance == pytest.approx(0.3 * 0.04 / 0.34 if math.isfinite(height_sd_m) else 0.3)


def cloud(storeys: LevelSheet, start: Pose) -> Cloud:
    return cloud_about(CloudSettings(), Start(start), 0.0, np.random.default_rng(1), storeys)


def test_who_stays_on_the_flat_stays_on_his_level_whatever_the_weather_does() -> None:
    plan = tower(3)
    storeys = level_sheet_of(plan)
    standing = cloud(storeys, Pose(15.0, 1.5, 0.0, 1))
    for minute in range(60):
        standing.change_levels(
            Move(0.0, 0.0, 0.0, 0.0), HeightChange(0.0, 0.0, 3.5 + 8.3 * minute / 60.0, 0.15, 3.5, 60.0)
        )
    assert (standing.level == 1).all()
    assert np.allclose(standing.z_m, STOREY_M)


def test_a_lift_carries_those_who_are_in_it() -> None:
    plan = tower(3)
    storeys = level_sheet_of(plan)
    riding = cloud_about(CloudSettings(), Start(Pose(*LIFT_AT, 0.0, 0), 0.05), 0.0, np.random.default_rng(1), storeys)
    for half in range(20):
        height_m = 100.0 + min(0.5 * half, 7.0)
        riding.change_levels(Move(0.0, 0.0, 0.0, 0.0), HeightChange(0.0, 0.0, height_m, 0.15, height_m, 0.5))
    assert np.bincount(riding.level, np.exp(riding.log_weight)).argmax() == 2
    order = np.argsort(riding.map_x_m)
    share = np.cumsum(riding.weight[order])
    assert np.ptp(riding.map_x_m[order][np.searchsorted(share, [0.05, 0.95])]) < 2.0


@pytest.mark.long
def test_an_unknown_level_becomes_known_on_the_stairs() -> None:
    """He starts on one of three levels, and climbs twice: only the lowest allows it."""
    way = [w for w in tour(3) if len(w) < 4 or w[3] <= 2 * STOREY_M][:-3]
    plan = tower(3)
    scenario, estimates = tracked(plan, way, 3, Pose(2.0, 1.5, 0.0, ANY_LEVEL))
    assert max(estimates[0].levels) < 0.5
    assert estimates[0].status is not TrackStatus.TRACKING
    error, _ = off(scenario, estimates)
    assert estimates[-1].level == 2
    assert estimates[-1].levels[2] > 0.95
    assert error[-1] < 0.5


# Walks


def test_a_walker_climbs_the_height_of_his_stairs() -> None:
    walked = walk(tour(2), Person(), np.random.default_rng(1))
    assert walked.height_m.max() == pytest.approx(STOREY_M)
    assert walked.height_m[-1] == pytest.approx(0.0)
    flat = walked.flat
    assert np.abs(np.diff(walked.foot_m[:, 2])).max() < 0.004, "no jumps"
    assert np.abs((walked.foot_m[:, 2] - walked.height_m)[flat]).max() < 0.5, "the foot stands on his step or the next"
    rising = np.gradient(walked.height_m) * 1000.0
    assert 0.2 < rising[rising > 0.01].mean() < 0.7, "m/s, up the stairs"
    assert rising.min() == pytest.approx(-1.0, abs=0.05), "m/s, the lift"


@pytest.mark.long
def test_a_walk_by_stairs_and_lift_is_followed() -> None:
    scenario, estimates = up_and_down()
    error, z = off(scenario, estimates)
    wrong = [
        e for e, height in zip(estimates, z, strict=True) if e.level != round(height / STOREY_M) and not between(height)
    ]
    assert not wrong
    assert {e.level for e in estimates} == {0, 1, 2}
    assert error.mean() < 0.3
    assert np.abs(z - [e.z_m for e in estimates]).max() < 1.5
    assert all(0.99 < sum(e.levels) < 1.0 + 1e-9 for e in estimates)  # the rest: a floor that the plan lacks


@pytest.mark.long
@pytest.mark.parametrize("wears_gyros", [False, True])
def test_without_the_foot_the_pressure_still_tells_the_level(wears_gyros: bool) -> None:
    """The MTx falls silent before the stairs: leg gyros carry the track on; without them it is lost, and the level comes back with the foot."""
    plan = tower(2)
    gyros = m.Sensors.THIGH | m.Sensors.CALF | m.Sensors.BELT
    worn = m.Sensors(0xFF) if wears_gyros else m.Sensors(0xFF) & ~gyros
    configure = m.Configure(worn, m.Schedule.CONCURRENT, 200, 10, m.PressureMode.HIGH_SPEED)
    scenario = Scenario(plan, tour(2), 2, PythonBoard(2), configure=configure)
    t_up = scenario.walk.t_s[np.argmax(scenario.walk.height_m > 0.1)] - 2.0
    t_top = scenario.walk.t_s[np.argmax(scenario.walk.height_m > STOREY_M - 0.01)] + 1.0
    silent = (1_000_000_000 + int(t_up * 1e9), 1_000_000_000 + int(t_top * 1e9))

    def heard(chunk: Chunk) -> bool:
        return chunk.port != MTX or not silent[0] < chunk.t_arrival_ns < silent[1]

    end_s = math.inf if wears_gyros else t_top + 10.0  # all that follows of a lost track is not looked at
    end_ns = 1_000_000_000 + 1e9 * end_s
    chunks = [c for c in takewhile(lambda c: c.t_arrival_ns < end_ns, scenario.chunks()) if heard(c)]
    tracker = Tracker(plan, scenario.start, seed=2)
    estimates = [e for k in range(0, len(chunks), 1000) for e in tracker.take(portion_of(chunks[k : k + 1000]))]
    later = [e for e in estimates if t_top + 5.0 < e.t_s < t_top + 8.0]
    silence = [e for e in estimates if t_up < e.t_s < t_top + 1.0]
    assert any(e.status is TrackStatus.LOST for e in silence) != wears_gyros
    assert later
    assert all(e.level == 1 for e in later)
