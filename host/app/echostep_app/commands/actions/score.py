# SPDX-License-Identifier: MIT
"""`echostep score`: tracks against the truth, by published metrics.

In: CSV files, recordings, a plan. Out: a table, JSON or an HTML page. Owns nothing.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from rich.markup import escape

from echostep.errors import EchostepError
from echostep.plan import NO_PLAN, Plan
from echostep.walk.walk import replay
from echostep_app.output.score_page import ScoreReport, page, short_names
from echostep_app.output.table import Table
from echostep_app.plan.importers.limited import open_limited
from echostep_app.printing.console import console_for_people
from echostep_app.printing.lines import as_error, complain, say
from echostep_app.scorecard.card import score as score_track
from echostep_app.scorecard.definitions import METRICS, as_text, notes
from echostep_app.scorecard.track_columns import ScoredPath, load_path, track_of
from echostep_app.scorecard.truth import is_recording, load_truth
from echostep_app.session.metadata import start_given
from echostep_app.session.options import TrackingOptions


def score(
    tracks: Sequence[Path],
    truth: Path | None,
    tracking: TrackingOptions,
    html: Path | None,
    setup_s: float | None,
    *,
    as_json: bool,
) -> None:
    """Print the scores as a table, or as JSON; write them to a page. Raises EchostepError."""
    plan = open_limited(tracking.plan_path) if tracking.plan_path else None
    truth = truth or next((path for path in tracks if is_recording(path)), None)
    if truth is None:
        raise EchostepError("the true path is missing: give it with --truth FILE, or score a recording that carries it")
    true = load_truth(truth, plan)
    loaded = [_track(path, plan, tracking) for path in tracks]
    scored = [score_track(track, true, plan, setup_s) for track in loaded]
    report = ScoreReport(scored, short_names(tracks), truth.name, plan)
    if as_json:
        json.dump(_tree(report, truth), sys.stdout, indent=1)
        sys.stdout.write("\n")
    else:
        console = console_for_people(highlight=False)
        for one in (true, *loaded):
            console.print(one.described(), markup=False)
        _table(report).print()
    if html:
        _write(html, page(report))
        (complain if as_json else say)(f"page: {html}")


def _track(path: Path, plan: Plan | None, tracking: TrackingOptions) -> ScoredPath:
    """A file's track, or that of a recording, which is tracked again."""
    if not is_recording(path):
        return load_path(path, plan)
    return track_of(replay(path, plan, start=start_given(tracking, plan or NO_PLAN)).estimates, str(path))


def _table(report: ScoreReport) -> Table:
    rows = [
        {"metric": metric.name, "source": metric.source}
        | {f"track {k}": as_text(metric.value(one.card), metric.unit) for k, one in enumerate(report.scored)}
        for metric in METRICS
    ]
    names = {f"track {k}": escape(name) for k, name in enumerate(report.names)}
    footnotes = [escape(line) for one in report.scored for line in notes(one.card)]
    return Table(escape(report.title), rows, {"metric": "", **names, "source": "defined in"}, footnotes)


def _tree(report: ScoreReport, truth: Path) -> dict[str, object]:
    """The scores as JSON objects: figures in metres, seconds and shares; null where there is none."""
    return {
        "truth": str(truth),
        "plan": report.plan.name if report.plan else None,
        "tracks": [asdict(one.card) for one in report.scored],
        "definitions": [
            {"name": m.name, "unit": "share" if m.unit == "%" else m.unit, "source": m.source, "meaning": m.meaning}
            for m in METRICS
        ],
    }


def _write(path: Path, text: str) -> None:
    with as_error(f"{path}: cannot write the page"):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
