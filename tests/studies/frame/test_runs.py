# SPDX-License-Identifier: MIT
"""The runs of a study: its journal, from which a killed study goes on, here and on a cluster; the studies' own distribution."""

from __future__ import annotations

import configparser
import math
import multiprocessing
import os
import signal
import subprocess
import sys
import zipfile
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import typer
from msgspec import UNSET, UnsetType
from typer.testing import CliRunner

from board_runs import ROOT
from echostep.errors import EchostepError
from echostep_app import cli
from echostep_app.commands.actions import offline as profiles
from echostep_studies.frame.report import as_dicts, write_json
from echostep_studies.frame.runs import Journal, SeededRuns
from waiting import until


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


@pytest.mark.long
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


@dataclass(frozen=True, slots=True, kw_only=True)
class CountedMore(Counted):
    """A row that may lack a column."""

    counts: list[int] | UnsetType = UNSET


def test_rows_come_back_from_the_journal_as_they_were(tmp_path: Path) -> None:
    rows = [
        Counted(name="a", value=math.inf),
        CountedMore(name="b", value=0.1, counts=[1]),
        CountedMore(name="c", value=0.0),
    ]
    path, kinds = tmp_path / "s.journal.jsonl", (Counted, CountedMore)
    Journal(path, kinds).add(7, rows)
    assert Journal(path, kinds).runs == {7: rows}
    assert [list(row) for row in as_dicts(rows)] == [["name", "value"], ["name", "value", "counts"], ["name", "value"]]


@pytest.mark.parametrize(
    "left", [b"", b"\0" * 40, b"\xff\x00[[[", b"[1]\n3\nnull\n", b'{"seed": 1, "rows": [["Cou', None], ids=str
)
def test_a_damaged_journal_loses_only_what_is_damaged(tmp_path: Path, left: bytes | None) -> None:
    path = tmp_path / "s.journal.jsonl"
    if left is None:
        path.mkdir()
    else:
        path.write_bytes(left + b'\n{"seed": 3, "rows": [["Counted", {"name": "a", "value": "no number"}]]}\n')
    journal = Journal(path, KINDS)
    assert not journal.runs
    journal.add(1, named("b", 1))
    assert Journal(path, KINDS).runs == {1: named("b", 1)}


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


@pytest.mark.parametrize("sigterm", [signal.SIG_DFL, signal.SIG_IGN])
def test_an_interrupted_study_waits_for_no_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, sigterm: signal.Handlers
) -> None:
    def interrupt(_journal: Journal[Counted], _seed: int, _rows: list[Counted]) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(Journal, "add", interrupt)
    signal.signal(signal.SIGTERM, sigterm)
    with pytest.raises(KeyboardInterrupt):
        SeededRuns("s", 2, 1, partial(held, str(tmp_path)), tmp_path, KINDS).rows()
    assert not multiprocessing.active_children()
    assert not (tmp_path / "finished").exists()


@pytest.mark.long
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


def test_results_that_cannot_be_written_are_one_clear_error(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(EchostepError, match="cannot write"):
        write_json(tmp_path / "file" / "x.json", "s", 1, 1, [])
    with pytest.raises(EchostepError, match="cannot write there"):
        SeededRuns("s", 1, 1, math_run, tmp_path / "file", KINDS).rows()


PACKAGE = ROOT / "host/studies/echostep_studies"


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> zipfile.ZipFile:
    pytest.importorskip("hatchling")
    folder = tmp_path_factory.mktemp("wheel")
    words = ["wheel", "--quiet", "--no-deps", "--no-build-isolation", "-w", str(folder), str(ROOT / "host/studies")]
    done = subprocess.run([sys.executable, "-m", "pip", *words], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    (built,) = folder.glob("echostep_studies-*.whl")
    return zipfile.ZipFile(built)


def test_the_wheel_holds_every_module_and_nothing_else(wheel: zipfile.ZipFile) -> None:
    modules = {str(path.relative_to(PACKAGE.parent)) for path in PACKAGE.rglob("*.py")}
    held = {name for name in wheel.namelist() if ".dist-info/" not in name}
    assert held == modules | {"echostep_studies/py.typed"}


def test_each_entry_point_leads_into_the_wheel(wheel: zipfile.ZipFile) -> None:
    (name,) = (name for name in wheel.namelist() if name.endswith(".dist-info/entry_points.txt"))
    points = configparser.ConfigParser()
    points.read_string(wheel.read(name).decode())
    found = {group: dict(points[group]) for group in points.sections()}
    assert set(found) == {cli.STUDIES, profiles.GROUP}
    assert set(found[cli.STUDIES]) == {"evaluate"}
    assert set(found[profiles.GROUP]) == {"foot.fischer2008", "legs.lee2010"}
    modules = [point.split(":")[0] for group in found.values() for point in group.values()]
    assert {f"{module.replace('.', '/')}.py" for module in modules} <= set(wheel.namelist())


def test_without_the_distribution_a_command_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cli, "entry_points", lambda **_: ())
    alone_app = typer.Typer()
    cli.add_studies(alone_app)
    words = "evaluate", "girard2011", "--runs", "1"
    alone, asked = (CliRunner().invoke(alone_app, given) for given in (words[:1], words))
    assert "pip install echostep-studies" in alone.output
    assert isinstance(asked.exception, EchostepError)
    assert "pip install echostep-studies" in str(asked.exception)
