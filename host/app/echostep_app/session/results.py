# SPDX-License-Identifier: MIT
"""Result files of a tracked run, and its summary on the terminal.

In: a tracker, its estimates, the true path where it is known. Out: track.csv, track.png and cues.csv in the output folder; a few lines. Owns nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from echostep.errors import EchostepError
from echostep.localization import Estimate, digest
from echostep.plan import Plan
from echostep.tracker import Tracker
from echostep.walk.table import write_track
from echostep_app.extras import lacks
from echostep_app.guidance.cue_list import CueList
from echostep_app.output.track_plot import draw_track
from echostep_app.plan.places.whereabouts import Whereabouts
from echostep_app.printing.console import console
from echostep_app.printing.lines import as_error
from echostep_app.printing.picture_files import load_matplotlib
from echostep_app.scorecard.card import Scorecard
from echostep_app.scorecard.track_columns import ScoredPath
from echostep_app.scorecard.truth import card_of
from echostep_app.wearer.steady_status import elsewhere


@dataclass(frozen=True, slots=True)
class Result:
    """Results of a run: `estimates`, the true path, the computing time where it is worth printing, how much was lost, silent or doubtful ports."""

    title: str
    estimates: Sequence[Estimate]
    truth: ScoredPath | None = None
    elapsed_s: float | None = None
    losses: str = ""
    silent: Sequence[str] = ()


def output_folder(path: Path) -> Path:
    """The folder for the results, made if it is missing; raises EchostepError when that fails."""
    with as_error(f"{path}: cannot make the folder", "; give another one with --out"):
        path.mkdir(parents=True, exist_ok=True)
    return path


def write_results(folder: Path, tracker: Tracker, guided: CueList | None, result: Result) -> None:
    """Write the tables, print the summary, draw the picture; raises EchostepError at the end when a file cannot be written.

    The picture comes last: drawing it takes longer than tracking a short walk.
    """
    card = card_of(result.estimates, result.truth) if result.truth else None
    failure = _write_tables(folder, guided, result)
    for line in result.silent:
        console.print(line, markup=False, highlight=False)
    if result.estimates:
        _print_summary(result, tracker.plan, card)
    undrawn = lacks("a picture", "matplotlib")
    if not undrawn:
        failure = failure or _draw(folder, tracker, guided, result, card)
    if not result.estimates:
        console.print(
            "No estimate: the foot never stood still, or no bytes of its sensor came; without one, no stride was seen."
        )
    if failure:
        raise failure
    if not result.estimates:
        return
    if not result.estimates[-1].step:
        console.print("No step was seen: the foot lay still or glided, as on wheels; it must stand in each step.")
    drawn = "" if undrawn else " and track.png"
    console.print(f"files: track.csv{drawn} in {folder}")
    if undrawn:
        console.print(f"track.png is left out: {undrawn}", markup=False)


def _write_tables(folder: Path, guided: CueList | None, result: Result) -> EchostepError | None:
    """Write track.csv and cues.csv; an error is returned, so that the summary is printed before it is raised."""
    try:
        write_track(folder / "track.csv", result.estimates)
        if guided:
            guided.write(folder / "cues.csv")
    except OSError as error:
        return EchostepError(f"{error.filename or folder}: cannot write the track: {error.strerror}")
    return None


def _draw(
    folder: Path, tracker: Tracker, guided: CueList | None, result: Result, card: Scorecard | None
) -> EchostepError | None:
    """Draw track.png; an error is returned."""
    load_matplotlib()
    title = f"{result.title}: mean error {card.horizontal.mean_m:.2f} m" if card else result.title
    route = guided.route if guided else None
    beacons = tracker.beacon_places(result.estimates[-1].t_s) if result.estimates else []
    try:
        draw_track(folder / "track.png", tracker.plan, result.estimates, result.truth, title, route, beacons)
    except EchostepError as error:
        return error
    return None


def summary_words(estimates: Sequence[Estimate], truth: ScoredPath | None) -> str:
    """How well a run went, in a sentence for the page."""
    if not estimates:
        return "no position was found"
    card = card_of(estimates, truth) if truth else None
    if card is None:
        return f"{len(estimates)} positions in {estimates[-1].t_s - estimates[0].t_s:.0f} s"
    return f"mean error {card.horizontal.mean_m:.2f} m, at most {card.horizontal.max_m:.2f} m"


def _print_summary(result: Result, plan: Plan, card: Scorecard | None) -> None:
    """The summary, a fact a line."""
    if card is not None:
        h = card.horizontal
        console.print(
            f"error: mean {h.mean_m:.2f} m, sd {h.sd_m:.2f}, max {h.max_m:.2f}, end {h.ending_m:.2f} m; RMSE {h.rms_m:.2f} m"
        )
        console.print(f"95 % ellipse: holds the truth {100 * (card.ellipse95_holds or 0.0):.0f} % of the time")
    estimates, end = result.estimates, result.estimates[-1]
    if result.losses:
        console.print(f"walk: {result.losses}", highlight=False)
    if not end.claims_place:
        console.print(f"end: place not known{elsewhere(end)}")
    elif words := Whereabouts(plan).words(end.x_m, end.y_m, end.level):
        floor = f", {plan.levels[end.level].name}" if len(plan.levels) > 1 else ""
        console.print(f"end: {words}{floor}{elsewhere(end)}", markup=False, highlight=False)
    if result.elapsed_s:
        span_s = estimates[-1].t_s - estimates[0].t_s
        speed = span_s / result.elapsed_s
        console.print(f"speed: {span_s:.0f} s of walk in {result.elapsed_s:.2f} s, {speed:.0f} x real time")
    console.print(f"estimates: {len(estimates)}, sha256 {digest(estimates)[:16]}")
