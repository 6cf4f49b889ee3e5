# SPDX-License-Identifier: MIT
"""`echostep score`: tracks against the truth, by published metrics.

In: CSV files, recordings, a plan. Out: a table or JSON. Owns nothing.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import NamedTuple

from rich.markup import escape

from echostep.errors import EchostepError
from echostep.plan import NO_PLAN, Plan
from echostep.recording import open_parts
from echostep.walk.table import refuse_none
from echostep_app.output.table import Table
from echostep_app.plan.importers.limited import open_limited
from echostep_app.printing.lines import complain, say
from echostep_app.scorecard.card import Scorecard
from echostep_app.scorecard.card import score as score_track
from echostep_app.scorecard.definitions import METRICS, as_text, notes
from echostep_app.scorecard.taps import tapped_walk
from echostep_app.scorecard.track_columns import ScoredPath, load_path, track_of
from echostep_app.scorecard.truth import is_recording, load_truth
from echostep_app.session.losses import skipped
from echostep_app.session.metadata import start_given
from echostep_app.session.options import TrackingOptions
from echostep_app.session.runs.replay import told_first, tracker_of


class Compared(NamedTuple):
    """The name of the truth, each track with its true path, and notes about the files."""

    truth: str
    pairs: list[tuple[ScoredPath, ScoredPath]]
    words: list[str]


def score(
    tracks: Sequence[Path],
    truth: Path | None,
    tracking: TrackingOptions,
    *,
    taps: bool,
    as_json: bool,
) -> None:
    """Print the scores as a table, or as JSON; `taps`: against the places that were tapped in each recording. Raises EchostepError."""
    plan = open_limited(tracking.plan_path) if tracking.plan_path else None
    compared = (_with_taps if taps else _with_truth)(tracks, truth, plan, tracking)
    say(*([] if as_json else compared.words))
    cards = [score_track(track, true, plan) for track, true in compared.pairs]
    if as_json:
        json.dump(_tree(cards, compared.truth, plan), sys.stdout, indent=1)
        sys.stdout.write("\n")
        return
    title = f"Scores against {Path(compared.truth).name}" + (f" on {plan.name}" if plan else "")
    _table(title, cards, _short_names(tracks)).print()


def _with_truth(tracks: Sequence[Path], truth: Path | None, plan: Plan | None, tracking: TrackingOptions) -> Compared:
    """All tracks with the same true path: the given one, or that of the first recording."""
    truth = truth or next((path for path in tracks if is_recording(path)), None)
    if truth is None:
        raise EchostepError("the true path is missing: give it with --truth FILE, or score a recording that carries it")
    true = load_truth(truth, plan)
    words: list[str] = []
    loaded = [_track(path, plan, tracking, words) for path in tracks]
    words += [one.described() for one in (true, *loaded)]
    return Compared(str(truth), [(track, true) for track in loaded], words)


def _with_taps(tracks: Sequence[Path], truth: Path | None, plan: Plan | None, tracking: TrackingOptions) -> Compared:
    """Each recording with its own taps."""
    if truth is not None or plan is None:
        raise EchostepError("--taps: give the plan on which the places were tapped with --plan, and no --truth")
    start = start_given(tracking, plan)
    walks = [tapped_walk(path, plan, start) for path in tracks]
    for line in (line for walk in walks for line in walk.damage):
        complain(line)
    return Compared("taps", [(walk.track, walk.truth) for walk in walks], [walk.words for walk in walks])


def _track(path: Path, plan: Plan | None, tracking: TrackingOptions, words: list[str]) -> ScoredPath:
    """A file's track, or that of a recording, which is tracked again; what replay tells of it is added to the words."""
    if not is_recording(path):
        return load_path(path, plan)
    recording, on = open_parts([path]), plan or NO_PLAN
    words += told_first(on, recording, tracking)
    tracker = tracker_of(recording, on, tracking)
    estimates = [e for portion in recording.portions() for e in tracker.take(portion)]
    refuse_none(estimates, path)
    words += skipped(recording, tracker.streams)
    return track_of(estimates, str(path))


def _short_names(paths: Sequence[Path]) -> list[str]:
    """The shortest unique endings of the paths."""
    for parts in range(1, max(len(path.parts) for path in paths) + 1):
        names = ["/".join(path.parts[-parts:]) for path in paths]
        if len(set(names)) == len(names):
            return names
    return [f"{k + 1}: {path.name}" for k, path in enumerate(paths)]


def _table(title: str, cards: Sequence[Scorecard], names: Sequence[str]) -> Table:
    rows = [
        {"metric": metric.name, "source": metric.source}
        | {f"track {k}": as_text(metric.value(card), metric.unit) for k, card in enumerate(cards)}
        for metric in METRICS
    ]
    columns = {f"track {k}": escape(name) for k, name in enumerate(names)}
    footnotes = [escape(line) for card in cards for line in notes(card)]
    return Table(escape(title), rows, {"metric": "", **columns, "source": "defined in"}, footnotes)


def _tree(cards: Sequence[Scorecard], truth: str, plan: Plan | None) -> dict[str, object]:
    """The scores as JSON objects: figures in metres, seconds and shares; null where there is none."""
    return {
        "truth": truth,
        "plan": plan.name if plan else None,
        "tracks": [asdict(card) for card in cards],
        "definitions": [
            {"name": m.name, "unit": "share" if m.unit == "%" else m.unit, "source": m.source, "meaning": m.meaning}
            for m in METRICS
        ],
    }
