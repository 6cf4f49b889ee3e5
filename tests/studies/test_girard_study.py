# SPDX-License-Identifier: MIT
"""The study of Girard's experiment: its walks, its rows, its journal; a small run of the command."""

from __future__ import annotations

import json
import math
import multiprocessing
import os
import sys
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from shapely import LineString, MultiLineString

from command_line import echostep
from echostep.errors import EchostepError
from echostep_studies.echoes.study import echoes_study
from echostep_studies.frame.report import summary, write_json
from echostep_studies.frame.runs import Journal, SeededRuns
from echostep_studies.frame.study import StudyRequest, run_study
from echostep_studies.girard2011 import study
from echostep_studies.simulation import sites
from echostep_studies.simulation.marker_walk import STEP_M, lay_markers, walk_markers
from waiting import until

SITES = [sites.otb(), *(build(3) for build in study.SITES.values())]
ECHOSTEP = Path(sys.executable).with_name("echostep")


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


def test_the_imu_row_is_calibrated_to_the_papers() -> None:
    """Means over walks: mean, deviation and maximum within 15 % of 0.59, 0.35 and 1.47 m; the end, the paper's maximum as well, within 20 %."""
    site = sites.otb()
    walks = [walk_markers(lay_markers(site.route), site.built, seed) for seed in range(100)]
    errors = [study._row("imu", "", 0, w, list(study.dead_reckoned(site, w, 0))).errors_m for w in walks]
    row = summary("imu", "girard2011", errors, [])
    assert row.mean_m == pytest.approx(0.59, rel=0.15)
    assert row.sd_m == pytest.approx(0.35, rel=0.15)
    assert row.max_m == pytest.approx(1.47, rel=0.15)
    assert row.ending_m == pytest.approx(1.47, rel=0.20)


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


def test_the_command_writes_rows_json_parquet_and_the_picture(tmp_path: Path) -> None:
    found = echostep("evaluate", "girard2011", "--runs", "1", "--json", "g.json", "--out", "out", cwd=tmp_path)
    assert found.returncode == 0, found.stderr
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


def test_what_rangers_hear(tmp_path: Path) -> None:
    run_study(echoes_study(fit=False), StudyRequest(1, 1, tmp_path / "e.json", tmp_path))
    rows = {row["name"]: row for row in json.loads((tmp_path / "e.json").read_text())["rows"]}
    assert (tmp_path / "figures1-5.png").stat().st_size > 50_000
    for name in ("incidence", "near and far", "oblique", "limits", "door frames"):
        assert rows[name]["log_p"] > rows[name]["uniform"], name
    assert "-6 dB at 27.5 degrees" in rows["angular response"]["finding"]
    assert "between 0.15 m and 6.00 m" in rows["limits"]["finding"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Counted:
    """A row."""

    name: str
    value: float


KINDS = (Counted,)


def counted(folder: str, seed: int) -> list[Counted]:
    """A run that leaves a trace."""
    (Path(folder) / f"ran-{seed}-{os.getpid()}").touch()
    return [Counted(name="a", value=math.sqrt(seed))]


class CountingRun:
    """A picklable run."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def __call__(self, seed: int) -> list[Counted]:
        return counted(str(self.folder), seed)

    def __repr__(self) -> str:
        return "CountingRun"


def ran(folder: Path) -> int:
    return len(list(folder.glob("ran-*")))


def test_a_killed_study_goes_on_where_it_was(tmp_path: Path) -> None:
    one = CountingRun(tmp_path)
    first = SeededRuns("s", 3, 10, one, tmp_path, KINDS).rows()
    (journal,) = tmp_path.glob("s.*.journal.jsonl")
    journal.write_text(journal.read_text() + '{"seed": 13, "rows": [{"na')  # killed while writing
    whole = SeededRuns("s", 5, 10, one, tmp_path, KINDS).rows()
    assert whole[:3] == first
    assert [row.value for row in whole] == [math.sqrt(seed) for seed in range(10, 15)]
    assert ran(tmp_path) == 5
    journal.rename(tmp_path / "s.other.journal.jsonl")
    assert SeededRuns("s", 2, 10, one, tmp_path, KINDS).rows() == whole[:2]
    assert ran(tmp_path) >= 6  # other code's rows are not taken


def named(name: str, _seed: int) -> list[Counted]:
    return [Counted(name=name, value=0.0)]


def test_rows_of_other_arguments_are_not_taken(tmp_path: Path) -> None:
    for name in ("first", "second", "first"):
        assert SeededRuns("s", 1, 10, partial(named, name), tmp_path, KINDS).rows() == named(name, 10)
    assert len(list(tmp_path.glob("s.*.journal.jsonl"))) == 2  # neither was overwritten


def held(folder: str, seed: int) -> list[Counted]:
    """The first run ends at once, another one only when it is patient no more."""
    if seed > 1:
        until((Path(folder) / "never").exists)
        (Path(folder) / "finished").touch()
    return [Counted(name="held", value=0.0)]


def test_an_interrupted_study_waits_for_no_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupt(_journal: Journal[Counted], _seed: int, _rows: list[Counted]) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(Journal, "add", interrupt)
    with pytest.raises(KeyboardInterrupt):
        SeededRuns("s", 2, 1, partial(held, str(tmp_path)), tmp_path, KINDS).rows()
    assert not multiprocessing.active_children()
    assert not (tmp_path / "finished").exists()


def test_the_same_numbers_from_a_cluster(tmp_path: Path) -> None:
    distributed = pytest.importorskip(
        "distributed", reason="skipped: no Dask (pip install 'echostep-studies[cluster]')"
    )
    here, there = tmp_path / "here", tmp_path / "there"
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, host="127.0.0.1"
    ) as cluster:
        far = SeededRuns("s", 4, 1, math_run, there, KINDS, cluster.scheduler_address).rows()
    assert far == SeededRuns("s", 4, 1, math_run, here, KINDS).rows()


def math_run(seed: int) -> list[Counted]:
    """Importable by the workers of a cluster."""
    return [Counted(name="m", value=float(np.random.default_rng(seed).random()))]


def test_no_cluster_is_one_clear_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed", reason="skipped: no Dask (pip install 'echostep-studies[cluster]')")
    monkeypatch.setattr("echostep_studies.frame.runs.SCHEDULER_TIMEOUT", "1s")
    with pytest.raises(EchostepError, match="no Dask scheduler answers there"):
        SeededRuns("s", 2, 1, math_run, tmp_path, KINDS, "tcp://127.0.0.1:9").rows()


def test_results_that_cannot_be_written_are_one_clear_error(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(EchostepError, match="cannot write"):
        write_json(tmp_path / "file" / "x.json", "s", 1, 1, [])
    with pytest.raises(EchostepError, match="cannot write there"):
        SeededRuns("s", 1, 1, math_run, tmp_path / "file", KINDS).rows()
