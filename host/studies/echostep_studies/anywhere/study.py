# SPDX-License-Identifier: MIT
"""The study `anywhere`: every trial of every seed, judged.

In: seeds; the public recordings for westport-house. Out: the table, JSON, Parquet, Stanford diagrams. Owns nothing.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np

from echostep_app.output.table import Table
from echostep_studies.anywhere.amcl import track_by_amcl
from echostep_studies.anywhere.trials import NEEDS_DATA, PEERED, TRIALS, Trial, Walks
from echostep_studies.bench.columns import ClaimsRow, JudgedRow, run_row, summaries, tables
from echostep_studies.bench.filtering import FilterRun, track
from echostep_studies.bench.judgement import SEARCH_M, JudgedRun, judge, true_places
from echostep_studies.bench.sites import westport_in
from echostep_studies.bench.stanford import draw_stanford
from echostep_studies.frame.parts import matching
from echostep_studies.frame.report import Row
from echostep_studies.frame.study import Study, StudyRequest

PEER = "/amcl"  # ending of the rows of augmented MCL


def one_run(names: tuple[str, ...], data: Path | None, seed: int) -> list[ClaimsRow]:
    """The trials of these names with the walks of this seed."""
    walks, rows = Walks(seed, data), []
    for name in names:
        trial = TRIALS[name.removesuffix(PEER)](walks)
        method = track_by_amcl if name.endswith(PEER) else track
        run = method(trial.walk.segments, trial.plan, trial.start, seed)
        rows.append(run_row(name, seed, _judged(trial, run) if trial.on_plan else None, run))
    return rows


def _judged(trial: Trial, run: FilterRun) -> JudgedRun:
    """The claims from the beginning of the search on."""
    walk, claims = trial.walk, [c for c in run.claims if c.t_s >= trial.from_s]
    t_s = np.array([c.t_s for c in claims])
    walked_m = walk.walked_m(t_s) - walk.walked_m(np.array([trial.from_s]))
    return judge(claims, true_places(walk.truth, t_s, trial.plan), walked_m)


def anywhere_study(data: Path | None, rows: str = "*") -> Study[ClaimsRow, Row]:
    """The study of the rows whose names match a pattern; `data`: folder of the public recordings, without which westport-house is left out.

    The peer's rows are run where the pattern names it: they cost three times what all others do.
    """
    westport_in(data)
    every = [name for trial in TRIALS if data or trial not in NEEDS_DATA for name in _methods(trial)]
    names = matching((name for name in every if name.endswith(PEER) == rows.endswith(PEER)), rows)
    return Study(
        "anywhere", (ClaimsRow, JudgedRow), partial(one_run, names, data), summaries, _tables, draw_runs=draw_stanford
    )


def _methods(trial: str) -> list[str]:
    """Names of the rows of a trial."""
    return [trial, trial + PEER] if trial in PEERED else [trial]


def _tables(rows: list[Row], request: StudyRequest) -> list[Table]:
    title = f"Found from nowhere, found again, and the radius: {request.runs} simulated walks a row"
    return tables(title, rows, SEARCH_M)
