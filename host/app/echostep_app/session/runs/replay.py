# SPDX-License-Identifier: MIT
"""`echostep replay`: track a recorded walk again, through the same stages as a live run.

In: a recording, its plan. Out: track, summary, errors where the true path is given. Owns nothing.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path

from echostep.plan import Plan
from echostep.recording import Recording, open_parts
from echostep.tracker import Tracker
from echostep.walk import recorded
from echostep.walk.recorded import is_simulated, shown_name
from echostep_app.interruption import until_asked
from echostep_app.printing.console import console
from echostep_app.printing.progress import with_bar
from echostep_app.scorecard.truth import load_truth, recorded_truth
from echostep_app.session.chunk_streams import paced, portions_of
from echostep_app.session.losses import skipped
from echostep_app.session.metadata import check_start, plan_of, start_given
from echostep_app.session.options import OutputOptions, TrackingOptions
from echostep_app.session.results import output_folder
from echostep_app.session.session import Session

VIEWED_PORTION = 8  # chunks tracked at once while a viewer looks on: about 10 ms


def replay(
    paths: Sequence[Path],
    tracking: TrackingOptions,
    truth_path: Path | None,
    output: OutputOptions,
    opened: Plan | None = None,
) -> None:
    """Track a recording, in one file or in parts; start, settings and seed are the recorded ones unless `tracking` gives others.

    `opened`: its plan, where it is open already.
    """
    recording, plan = open_parts(paths), opened or plan_of(tracking)
    path = recording.path
    truth = load_truth(truth_path, plan) if truth_path else recorded_truth(recording, plan)
    tracker = tracker_of(recording, plan, tracking)
    check_start(plan, tracker.start, given=tracking.start is not None, recorded="start_x_y_rad" in recording.metadata)
    for line in told_first(plan, recording, tracking):
        console.print(line, markup=False)
    output_folder(output.folder)
    if note := recording.metadata.get("note"):
        console.print(f"Recording: {note}")
    title = f"echostep replay {shown_name(path, recording.metadata)}"
    is_made = is_simulated(recording.metadata)
    with Session(tracker, title, "simulated" if is_made else "replay", output, tracking.guide_to, recording) as session:
        session.prepare()
        session.show_truth(truth)
        start_s = time.perf_counter()
        portions = recording.portions()
        if output.foxglove:  # a viewer shows what comes, so it comes as it came
            portions = portions_of(paced(recording.chunks(), 1.0), VIEWED_PORTION)
        if not output.terminal:
            portions = with_bar(portions, f"tracking {path.name}", lambda: recording.fraction)
        session.track(until_asked(portions), lambda: recording.fraction)
        elapsed_s = time.perf_counter() - start_s
        for line in skipped(recording, tracker.streams):
            console.print(line, markup=False, highlight=False)
        session.finish(path.name, elapsed_s)
        session.keep_page_open()


def told_first(plan: Plan, recording: Recording, tracking: TrackingOptions) -> list[str]:
    """Warnings before a recording is tracked: that it is another plan, that no start is known."""
    known = plan.start or tracking.start or {"start", "start_x_y_rad"} & recording.metadata.keys()
    anywhere = "No start is known, so the walk is sought anywhere: --start X,Y,DEG gives it."
    return [line for line in (plan_note(plan, recording), anywhere * (plan.is_drawn and not known)) if line]


def plan_note(plan: Plan, recording: Recording) -> str:
    """A note where a recording was tracked on another plan; empty on the same one, and without a plan."""
    if not plan.is_drawn or recording.metadata.get("plan_sha256", plan.digest) == plan.digest:
        return ""
    return f"Note: {plan.name} is not the plan that {recording.path.name} was tracked on."


def tracker_of(recording: Recording, plan: Plan, tracking: TrackingOptions) -> Tracker:
    """A tracker with the recorded start, settings and seed unless `tracking` gives others; raises EchostepError."""
    return recorded.tracker_of(recording, plan, start_given(tracking, plan), tracking.settings_path, tracking.seed)
