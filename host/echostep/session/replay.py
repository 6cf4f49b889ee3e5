"""`echostep replay`: track a recorded walk again, through the same stages as a live run.

In: a recording, its plan. Out: track, summary, errors where the true path is given. Owns nothing.
"""

from __future__ import annotations

import time
from pathlib import Path

from echostep.guidance.guided_run import destination
from echostep.localization.metrics import load_truth
from echostep.plan.importers.formats import open_plan
from echostep.plan.model import Plan
from echostep.recording.recorder import Recording, open_recording
from echostep.session.console import console
from echostep.session.metadata import CHECK_IN_START, recorded_seed, recorded_start
from echostep.session.options import OutputOptions, TrackingOptions
from echostep.session.results import output_folder
from echostep.session.session import Session
from echostep.settings import parse_settings, read_settings
from echostep.tracker import Tracker


def replay(path: Path, tracking: TrackingOptions, truth_path: Path | None, output: OutputOptions) -> None:
    """Track a recording; start, settings and seed are the recorded ones unless `tracking` gives others."""
    recording, plan = open_recording(path), open_plan(tracking.plan_path)
    if recording.metadata.get("plan_sha256", plan.digest) != plan.digest:
        console.print(f"Note: {tracking.plan_path} is not the plan that {path} was tracked on.")
    truth = load_truth(truth_path) if truth_path else None
    tracker = tracker_of(recording, plan, tracking)
    output_folder(output.folder)
    if note := recording.metadata.get("note"):
        console.print(f"Recording: {note}")
    guide_to = destination(tracking.guide_to, plan) if tracking.guide_to else None
    session = Session(tracker, f"echostep replay {path.name}", "replay", output, guide_to)
    tracker.warm_up()
    with session:
        start_s = time.perf_counter()
        session.track(recording.portions(), lambda: recording.fraction)
        elapsed_s = time.perf_counter() - start_s
        if recording.truncated:
            console.print(f"{path}: the recording ends in the middle of a record; all before it was used")
        session.finish(path.name, truth, elapsed_s)
        session.keep_page_open()


def tracker_of(recording: Recording, plan: Plan, tracking: TrackingOptions) -> Tracker:
    """A tracker with the recorded start, settings and seed unless `tracking` gives others.

    Raises EchostepError when one of them is missing or damaged.
    """
    metadata, path = recording.metadata, recording.path
    settings_path = tracking.settings_path
    text = read_settings(settings_path) if settings_path else metadata.get("settings_toml", "")
    settings = parse_settings(text, str(settings_path or path))
    start = tracking.start or recorded_start(metadata, path)
    seed = recorded_seed(metadata, path) if tracking.seed is None else tracking.seed
    return Tracker(plan, start, settings, seed, waits=metadata.get("start") == CHECK_IN_START)
