"""Result files of a tracked run, and its summary on the terminal.

In: a tracker, its estimates, the true path where it is known. Out: track.csv, track.png and cues.csv in the output folder; a few lines. Owns nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from echostep.errors import EchostepError
from echostep.guidance.guided_run import GuidedRun
from echostep.localization.estimate import Estimate, digest
from echostep.localization.metrics import Errors, Truth, errors
from echostep.output.track_plot import draw_track, write_track
from echostep.session.console import console
from echostep.tracker import Tracker


@dataclass(frozen=True, slots=True)
class Result:
    """What a run gave: `estimates`, the true path to compare with, and the computing time where it is worth printing."""

    title: str
    estimates: Sequence[Estimate]
    truth: Truth | None = None
    elapsed_s: float | None = None


def output_folder(path: Path) -> Path:
    """The folder for the results, made if it is missing; raises EchostepError when that fails."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise EchostepError(f"{path}: cannot make the folder: {error.strerror}; give another one with --out") from error
    return path


def write_results(folder: Path, tracker: Tracker, guided: GuidedRun | None, result: Result) -> None:
    """Write the files, then print the summary; raises EchostepError at the end when a file cannot be written."""
    deviation = errors(result.estimates, result.truth) if result.truth else None
    failure = _write_files(folder, tracker, guided, result, deviation)
    if not result.estimates:
        console.print(
            "No estimate: the foot never stood still, or no MTx bytes came; without an MTx, no stride was seen."
        )
        return
    _print_summary(result, deviation, "" if failure else f"; track.csv and track.png are in {folder}")
    if failure:
        raise failure


def _write_files(
    folder: Path, tracker: Tracker, guided: GuidedRun | None, result: Result, deviation: Errors | None
) -> EchostepError | None:
    """Write all files; an error is returned, so that the summary is printed before it is raised."""
    title = f"{result.title}: mean error {deviation.mean_m:.2f} m" if deviation else result.title
    route = guided.route if guided else None
    try:
        write_track(folder / "track.csv", result.estimates)
        beacons = tracker.beacon_places(result.estimates[-1].t_s) if result.estimates else []
        draw_track(folder / "track.png", tracker.plan, result.estimates, result.truth, title, route, beacons)
        if guided:
            guided.write(folder / "cues.csv")
    except OSError as error:
        return EchostepError(f"{folder}: cannot write the track: {error.strerror}")
    return None


def _print_summary(result: Result, deviation: Errors | None, written: str) -> None:
    if deviation is not None:
        console.print(
            f"error: mean {deviation.mean_m:.2f} m, sd {deviation.sd_m:.2f}, max {deviation.max_m:.2f}, "
            f"end {deviation.ending_m:.2f} m; RMSE {deviation.rmse_m:.2f} m; "
            f"truth inside the 95 % ellipse {100 * deviation.coverage95:.0f} % of the time"
        )
    estimates = result.estimates
    if result.elapsed_s:
        span_s = estimates[-1].t_s - estimates[0].t_s
        speed = span_s / result.elapsed_s
        console.print(f"{span_s:.0f} s of walk in {result.elapsed_s:.2f} s: {speed:.0f} x real time")
    console.print(f"{len(estimates)} estimates, sha256 {digest(estimates)[:16]}{written}")
