# SPDX-License-Identifier: MIT
"""`echostep score`: the table, JSON, and faults in one line."""

from __future__ import annotations

import json
import re
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any

import numpy as np
import pytest

from command_line import echostep
from walks import DEMO


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A true way along the corridor of the demo plan, and two tracks of it, one without radius and with a name that is markup."""
    folder = tmp_path_factory.mktemp("score")
    t_s = np.arange(0.0, 20.0, 0.1)
    true = np.column_stack([t_s, 2.0 + t_s, np.full(len(t_s), 7.5)])
    rng = np.random.default_rng(1)
    off = rng.normal(0.0, 0.3, (len(t_s), 2))
    radius = np.full((len(t_s), 1), 0.9)
    _write(folder / "truth.csv", "t,x,y", true)
    _write(folder / "ours.csv", "t_s,x_m,y_m,radius95_m", np.hstack([true + np.insert(off, 0, 0.0, axis=1), radius]))
    _write(folder / "<b>[red]theirs.csv", "t,x,y", true + [0.0, 1.0, 0.0])
    return folder


def _write(path: Path, names: str, table: Any) -> None:
    np.savetxt(path, table, delimiter=",", header=names, comments="", fmt="%.6f")


def score(folder: Path, *words: object) -> CompletedProcess[str]:
    """The command's end, with the true way of the folder."""
    return echostep("score", *words, "--truth", folder / "truth.csv")


def test_the_table_has_a_column_a_track_and_says_what_was_read(folder: Path) -> None:
    done = score(folder, folder / "ours.csv", folder / "<b>[red]theirs.csv", "--plan", DEMO)
    assert (done.returncode, done.stderr) == (0, "")
    assert "ours.csv: time is t_s, x is x_m, y is y_m, radius95 is radius95_m" in done.stdout
    assert "<b>[red]theirs.csv" in done.stdout
    row = next(line for line in done.stdout.splitlines() if "CE95" in line)
    assert re.search(r"0\.\d\d m .*1\.00 m .*ISO/IEC 18305:2016, 8\.9", row), row


def test_json_has_every_figure_and_null_for_none(folder: Path) -> None:
    done = score(folder, folder / "<b>[red]theirs.csv", "--json")
    tree = json.loads(done.stdout)
    (card,) = tree["tracks"]
    assert (card["ce50_m"], card["ce95_m"], card["evaal_m"]) == pytest.approx((1.0, 1.0, 1.0))
    assert (card["se95_m"], card["zone_probability"], card["radius95_holds"]) == (None, None, None)
    assert {"name", "unit", "source", "meaning"} == set(tree["definitions"][0])


def test_a_fault_is_one_line_and_status_2(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "bad.csv").write_text("t,x,y\n1,2,three\n")
    done = score(folder, tmp_path / "bad.csv")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == f"echostep: {tmp_path}/bad.csv:2: column y: 'three' is not a number\n"
    missing = score(folder, tmp_path / "none.csv")
    assert missing.stderr == f"echostep: {tmp_path}/none.csv: cannot read it: No such file or directory\n"
