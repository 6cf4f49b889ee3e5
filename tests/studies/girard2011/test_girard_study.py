# SPDX-License-Identifier: MIT
"""The study of Girard's experiment: its walks, its rows; a small run of the command.

The study of the kits: its rows, on the same steps.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from shapely import LineString, MultiLineString

from command_line import echostep
from echostep_studies.echoes.study import echoes_study
from echostep_studies.frame.report import rows_by_name, summary
from echostep_studies.frame.study import StudyRequest, run_study
from echostep_studies.girard2011 import kit_feet, kits, study
from echostep_studies.simulation import sites
from echostep_studies.simulation.marker_walk import STEP_M, lay_markers, walk_markers
from echostep_studies.simulation.sites import otb

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
    errors = [study._row("imu", "", 0, w, list(study.dead_reckoned(site, w, 0))).errors_m for w in walks]
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
