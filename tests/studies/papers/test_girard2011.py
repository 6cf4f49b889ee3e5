# SPDX-License-Identifier: MIT
"""Girard et al. 2011: each printed formula against a naive twin, whole steps, and the study of their experiment; a fan of rays."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import LineString, MultiLineString

from command_line import echostep
from echostep.arrays import Floats
from echostep.walls.echo_sources import Walls
from echostep_studies.echoes.study import echoes_study
from echostep_studies.frame.report import rows_by_name, summary
from echostep_studies.frame.study import StudyRequest, run_study
from echostep_studies.girard2011 import kit_feet, kits, study
from echostep_studies.papers.girard2011 import Girard, GirardSettings, average, disc, merge, moved, similarity
from echostep_studies.papers.girard2011_rays import lambda_ray_ranges
from echostep_studies.simulation import sites
from echostep_studies.simulation.marker_walk import STEP_M, lay_markers, walk_markers
from echostep_studies.simulation.sites import otb
from naive import walls as naive
from walls.test_walls import plans

ROOM = np.array([[0.0, 0.0, 5.0, 0.0], [5.0, 0.0, 5.0, 3.0], [5.0, 3.0, 0.0, 3.0], [0.0, 3.0, 0.0, 0.0]])
PRINTED = GirardSettings()
floats = st.floats(0.05, 6.0)


def cloud(walls: np.ndarray | None = ROOM, settings_: GirardSettings = PRINTED) -> Girard:
    return Girard(settings_, (2.0, 1.5), walls, np.random.default_rng(1))


def test_the_parameters_are_the_printed_ones() -> None:
    assert (PRINTED.nu, PRINTED.epsilon_m, PRINTED.kappa, PRINTED.tau_m, PRINTED.rays) == (150, 0.25, 20, 0.05, 7)
    assert math.degrees(PRINTED.aperture_rad) == pytest.approx(55.0)


def test_step_3_draws_uniformly_in_the_disc() -> None:
    errors = disc(np.random.default_rng(2), 20_000, 0.25)
    radius = np.hypot(*errors.T)
    assert radius.max() <= 0.25
    # Half of the area holds half of them
    assert np.mean(radius < 0.25 * math.sqrt(0.5)) == pytest.approx(0.5, abs=0.02)
    assert np.abs(errors.mean(0)).max() < 0.005


def test_step_4_applies_every_vector_to_every_particle_and_walls_remove() -> None:
    x, y = np.array([1.0, 4.9]), np.array([1.5, 1.5])
    vectors = np.array([[0.0, 0.2], [0.3, 0.0]])
    to_x, to_y, parent = moved(x, y, vectors, Walls(ROOM).near(x, y))
    assert parent.tolist() == [0, 0, 1]  # the last would have gone through the wall at x = 5
    assert to_x.tolist() == [1.0, 1.3, 4.9]
    assert to_y.tolist() == [1.7, 1.5, 1.7]


@given(st.lists(st.tuples(st.floats(-0.2, 0.2), st.floats(-0.2, 0.2), st.floats(0.01, 1.0)), min_size=1, max_size=60))
def test_step_5_merges_what_is_closer_than_tau(points: list[tuple[float, float, float]]) -> None:
    points = sorted(points, key=lambda point: -point[2])
    rows = np.array(points)
    x, y, weight = merge(rows[:, 0].copy(), rows[:, 1].copy(), rows[:, 2].copy(), 0.05)
    kept = naive.merged(points, 0.05)
    assert sorted(zip(x.tolist(), y.tolist(), strict=True)) == sorted((a, b) for a, b, _ in kept)
    assert weight.sum() == pytest.approx(rows[:, 2].sum())
    apart = [
        math.hypot(a - c, b - d)
        for k, (a, b) in enumerate(zip(x, y, strict=True))
        for c, d in zip(x[:k], y[:k], strict=True)
    ]
    assert all(away >= 0.05 for away in apart)


@given(st.lists(st.tuples(floats, floats), min_size=1, max_size=10), st.tuples(floats, floats))
def test_equation_1(modelled: list[tuple[float, float]], measured: tuple[float, float]) -> None:
    found = similarity(np.array(modelled), np.array(measured), 6.0)
    assert found == pytest.approx([naive.similarity(row, measured, 6.0) for row in modelled])


def test_equation_1_of_a_perfect_match_and_of_no_echo() -> None:
    assert similarity(np.array([[1.0, 2.0]]), np.array([1.0, 2.0]), 6.0)[0] == 1.0
    assert similarity(np.array([[3.0, 6.0]]), np.array([6.0, 6.0]), 6.0)[0] == pytest.approx(0.75)


def test_equation_2() -> None:
    assert average(np.array([0.0, 4.0]), np.array([2.0, 2.0]), np.array([3.0, 1.0])) == (1.0, 2.0)


def test_a_step_without_echoes_moves_and_merges_as_the_twin() -> None:
    """Steps 2 to 5, whose particles near each other may give their weight to another one."""
    filter_, twin = cloud(), naive.Girard(ROOM, (2.0, 1.5), np.random.default_rng(1))
    filter_.step(0.5, 0.0, 0.0, None)
    twin.step(0.5, 0.0, 0.0, None)
    kept = sorted(zip(filter_.x_m.tolist(), filter_.y_m.tolist(), strict=True))
    assert np.array(kept) == pytest.approx(np.array(sorted(particle[:2] for particle in twin.particles)), abs=1e-9)
    assert filter_.weight.sum() == pytest.approx(sum(particle[2] for particle in twin.particles))


@pytest.mark.long
def test_one_step_is_the_eight_steps() -> None:
    """Against the whole filter in plain Python, with the same draws."""
    filter_, twin = cloud(), naive.Girard(ROOM, (2.0, 1.5), np.random.default_rng(1))
    for dx, pair in ((0.5, (1.5, 1.5)), (0.6, (1.4, math.nan)), (-0.4, (1.5, 1.6))):
        at = filter_.step(dx, 0.0, 0.0, pair)
        assert at == pytest.approx(twin.step(dx, 0.0, 0.0, pair), abs=1e-9)
        assert len(filter_.x_m) == len(twin.particles)


def test_the_cloud_is_capped_and_stays_in_the_room() -> None:
    filter_ = cloud()
    for _ in range(6):
        filter_.step(0.1, 0.0, 0.0, None)
    assert len(filter_.x_m) == 150
    assert ((filter_.x_m > 0.0) & (filter_.x_m < 5.0) & (filter_.y_m > 0.0) & (filter_.y_m < 3.0)).all()


def test_without_a_model_the_cloud_grows() -> None:
    filter_, spread = cloud(None), []
    for _ in range(12):
        filter_.step(0.0, 0.0, 0.0, None)
        spread.append(float(np.hypot(filter_.x_m - 2.0, filter_.y_m - 1.5).mean()))
    assert spread[5] > 1.5 * spread[0]


def test_a_step_through_a_wall_is_made_and_counted() -> None:
    filter_ = cloud()
    x, _ = filter_.step(6.0, 0.0, 0.0, None)
    assert x == pytest.approx(8.0, abs=0.2)
    assert filter_.lost == 1


SITES = [sites.otb(), *(build(3) for build in study.SITES.values())]


def test_the_route_is_the_papers() -> None:
    markers = lay_markers(sites.otb().route)
    assert len(markers) - 1 == 52
    assert np.hypot(*np.diff(markers, axis=0).T) == pytest.approx(STEP_M)
    assert markers[0].tolist() == markers[26].tolist() == markers[52].tolist()


@pytest.mark.parametrize("site", SITES, ids=lambda site: site.name)
def test_routes_go_through_doors_and_not_through_walls(site: sites.SimulatedSite) -> None:
    way = LineString(lay_markers(site.route))
    built = MultiLineString([(w[:2], w[2:]) for w in site.built.tolist()])
    assert way.distance(built) > 0.3


@pytest.mark.long
def test_the_imu_row_is_calibrated_to_the_papers() -> None:
    """Means over walks: mean, deviation and maximum within 15 % of 0.59, 0.35 and 1.47 m; the end, the paper's maximum as well, within 20 %."""
    site = sites.otb()
    walks = [walk_markers(lay_markers(site.route), site.built, seed) for seed in range(100)]
    errors = [study.method_run("imu", "", 0, w, study.dead_reckoned(site, w, 0)).errors_m for w in walks]
    row = summary("imu", "girard2011", errors, [])
    assert row["mean_m"] == pytest.approx(0.59, rel=0.15)
    assert row["sd_m"] == pytest.approx(0.35, rel=0.15)
    assert row["max_m"] == pytest.approx(1.47, rel=0.15)
    assert row["ending_m"] == pytest.approx(1.47, rel=0.20)


def test_a_walk_is_a_function_of_its_seed() -> None:
    site = sites.furnished(2)
    first, again, other = (walk_markers(lay_markers(site.route), site.built, s, site.passers) for s in (2, 2, 3))
    assert first.pings.range_m.tobytes() == again.pings.range_m.tobytes() != other.pings.range_m.tobytes()
    assert first.pings.t_s[-1] > 60.0
    assert len(first.pings.t_s) / first.pings.t_s[-1] > 28.0


def test_a_fifth_of_the_pings_meet_somebody_first() -> None:
    site = sites.furnished(4)
    alone, among = (walk_markers(lay_markers(site.route), site.built, 4, share).pings for share in (0.0, 0.2))
    assert np.mean(among.range_m < 0.95 * np.nan_to_num(alone.range_m, nan=9.0)) == pytest.approx(0.2, abs=0.08)


@pytest.mark.long
def test_the_command_writes_rows_json_parquet_and_the_picture(tmp_path: Path) -> None:
    found = echostep("evaluate", "girard2011", "--runs", "1", "--json", "g.json", "--out", "out", cwd=tmp_path, ends=0)
    written = json.loads((tmp_path / "g.json").read_text())
    assert (written["study"], written["runs"], written["seed"]) == ("girard2011", 1, 1)
    assert [row["name"] for row in written["rows"]] == [
        "imu", "model", "ranging", "default", *(f"default/{name}" for name in study.SITES)
    ]  # fmt: skip
    mean = {row["name"]: row["mean_m"] for row in written["rows"]}
    assert mean["default"] < 0.15 < mean["imu"]
    assert all({"mean_m", "sd_m", "max_m", "min_m", "ending_m", "lost"} <= set(row) for row in written["rows"])
    assert {p.name for p in (tmp_path / "out").iterdir()} >= {"girard2011.parquet", "figures10-13.png"}
    assert "imu, the paper" in found.stdout


@pytest.mark.long
def test_what_rangers_hear(tmp_path: Path) -> None:
    run_study(echoes_study(fit=False), StudyRequest(1, 1, tmp_path / "e.json", tmp_path))
    rows = {row["name"]: row for row in json.loads((tmp_path / "e.json").read_text())["rows"]}
    for name in ("incidence", "near and far", "oblique", "limits", "door frames"):
        assert rows[name]["log_p"] > rows[name]["uniform"], name
    assert "-6 dB at 27.5 degrees" in rows["angular response"]["finding"]
    assert "between 0.15 m and 6.00 m" in rows["limits"]["finding"]


@pytest.mark.long
def test_both_kinds_of_rangers_hold_the_papers_figure_on_the_same_steps() -> None:
    rows = kits.one_run(3)
    names = [row.name for row in rows]
    of_rangers = [row for row in rows if not row.name.startswith("foot alone")]
    assert len(set(names)) == 12 + 8
    assert len(of_rangers) == 12
    assert all(len(row.errors_m) == 52 for row in of_rangers)
    means = {row.name: float(np.mean(row.errors_m)) for row in rows}
    assert means["default, SRF02"] < 0.13  # what the paper's system reached with ranging [Girard 2011, Table 1]
    assert means["default, pulse"] < 0.13
    assert means["default, MaxSonar"] < 0.13
    assert [group[0].name for group in rows_by_name(rows)]
    walks = [kits._walk(otb(), 3, kind) for kind in kits.kinds().values()]
    assert all(np.array_equal(walk.trunk_m, walks[0].trunk_m) for walk in walks)
    assert all(np.array_equal(walk.heading_rad, walks[0].heading_rad) for walk in walks)


@pytest.mark.parametrize(("name", "reach_m"), [("SRF02", 6.0), ("pulse", 4.5), ("MaxSonar", 7.65)])
def test_the_tracker_and_the_simulation_agree_on_the_reach_of_rangers(name: str, reach_m: float) -> None:
    kind = kits.kinds()[name]
    assert (kind.echo.maximum_m, kind.acoustics.maximum_m) == (reach_m, reach_m)
    assert kind.echo.minimum_m == kind.acoustics.minimum_m
    pings = kits._walk(otb(), 3, kind).pings
    heard_m = pings.range_m[np.isfinite(pings.range_m)]
    assert kind.acoustics.minimum_m <= heard_m.min()
    assert 0.5 * reach_m < heard_m.max() <= reach_m + 0.1
    assert np.diff(pings.t_s[pings.ranger == 0]).mean() == pytest.approx(2.0 * kind.half_s, abs=1e-3)


def test_a_foot_board_is_as_good_as_an_mtx_on_the_same_steps() -> None:
    rows = [kit_feet.rows(seed) for seed in (1, 2, 3)]
    means = {
        row.name: float(np.mean([np.mean(of_seed[k].errors_m) for of_seed in rows])) for k, row in enumerate(rows[0])
    }
    assert all(len(row.errors_m) > 20 for of_seed in rows for row in of_seed)
    for pace in kit_feet.PACES:
        assert means[f"foot alone, {pace}, foot board, calibrated"] < 2.0 * means[f"foot alone, {pace}, MTx 18 g"] + 0.1
    assert max(means.values()) < 3.0


def test_the_table_of_kits_has_the_rows_of_a_filter_together() -> None:
    names = ["default, SRF02", "paper's filter, SRF02", "default, pulse"]
    (table,) = kits.STUDY.tables([{"name": name} for name in names], StudyRequest(1, 1, None, Path()))
    assert [row["name"] for row in table.rows] == [names[0], names[2], names[1]]


@pytest.mark.long
@settings(max_examples=150, deadline=None)
@given(plans(), st.sampled_from([7, 7, 7, 1, 3, 20]), st.sampled_from([0.0, 0.5, 1.0, 2.0]))
def test_cone_readings_agree_with_plain_rays(
    plan: tuple[Floats, np.random.Generator], rays: int, prepared: float
) -> None:
    walls, rng = plan
    aperture = math.radians(55.0)
    owner = Walls(walls, prepared * 0.5 * aperture / rays)
    x, y, heading = rng.uniform(-2, 10, 12), rng.uniform(-2, 10, 12), rng.uniform(-4, 4, 12)
    index = owner.near(x[:9], y[:9])
    found = lambda_ray_ranges(x, y, heading, index, rays, aperture, 6.0)
    for i, row in enumerate(found):
        for axis, reading in zip((math.pi / 2, -math.pi / 2), row, strict=True):
            expected = naive.cone_reading(x[i], y[i], heading[i] + axis, walls, rays, aperture, 6.0)
            assert reading == pytest.approx(expected, abs=1e-9)


@pytest.mark.long
def test_many_poses_read_what_each_would_alone() -> None:
    """Many in a tile, in no order, some nowhere."""
    rng = np.random.default_rng(5)
    walls = rng.uniform(0.0, 6.0, (20, 4))
    owner = Walls(walls, 0.5 * math.radians(55.0) / 7)
    x, y, heading = rng.uniform(2.0, 4.0, 768), rng.uniform(2.0, 3.0, 768), rng.uniform(-4, 4, 768)
    x[::50], heading[7::50] = np.nan, np.inf
    index = owner.near(x, y)
    cone = 7, math.radians(55.0), 6.0
    found = lambda_ray_ranges(x, y, heading, index, *cone)
    alone = [lambda_ray_ranges(x[i : i + 1], y[i : i + 1], heading[i : i + 1], index, *cone)[0] for i in range(len(x))]
    assert found == pytest.approx(np.array(alone), abs=1e-9)
    assert (found[::50] == 6.0).all()
    assert (found[7::50] == 6.0).all()
    assert len(np.unique(found)) > 256
