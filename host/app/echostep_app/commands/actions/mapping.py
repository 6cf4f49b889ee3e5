# SPDX-License-Identifier: MIT
"""`echostep map`: the plan of a building from a recorded walk.

In: a recording. Out: plan.json, a picture, a summary in words. Owns nothing.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep.path import MeasuredSegment
from echostep.plan import NO_PLAN, Plan, Pose
from echostep.recording import Recording, open_recording
from echostep.walk.recorded import recorded_start
from echostep_app.mapping.graph.directions import LEAST_EVIDENCE
from echostep_app.mapping.mapper import Mapped, map_walk
from echostep_app.mapping.picture import draw_picture
from echostep_app.mapping.plan import plan_of
from echostep_app.mapping.walls.place_sd import OFF_M
from echostep_app.plan.places.findings import refusals
from echostep_app.plan.writer import save_plan
from echostep_app.printing.lines import say
from echostep_app.printing.progress import bar, with_bar
from echostep_app.session.losses import skipped
from echostep_app.session.options import TrackingOptions
from echostep_app.session.runs.replay import tracker_of

LEAST_WAY_M = 3.0  # of path that shows a wall
WALK_START = "0,0,90"  # of the walk that is drawn: the recorded start moves the drawing afterwards


def map_recording(path: Path, out: Path, picture: Path | None) -> None:
    """Draw the building of a recorded walk; raises EchostepError when the recording is no walk or has no echo of a wall."""
    for written in (out, picture):
        if written is not None and written.resolve() == path.resolve():
            raise EchostepError(f"{written}: this is the recording: give the result another name")
    recording = open_recording(path)
    segments = segments_of(recording)
    with bar(f"drawing {recording.path.name}") as show:
        mapped = map_walk(segments, show)
    plan, walked_m = plan_of(mapped, _start_of(recording), path.stem)
    if not plan.is_drawn and not refusals(plan):
        raise EchostepError(
            f"{recording.path}: no walls were heard beside the path: is a ranger covered, or was it walked outside?"
        )
    save_plan(plan, out)
    lines = described(mapped, plan)
    if picture is not None:
        draw_picture(picture, plan, walked_m)
        lines.append(f"picture: {picture}")
    for line in [*lines, f"{out}: check and mend it with echostep plan edit {out}"]:
        say(line)


def segments_of(recording: Recording) -> list[MeasuredSegment]:
    """The path of a recording with its pings, as far as it is readable; raises EchostepError when it has no steps or no echo."""
    tracker = tracker_of(recording, NO_PLAN, TrackingOptions(None, start=WALK_START, seed=0))
    portions = with_bar(recording.portions(), f"reading {recording.path.name}", lambda: recording.fraction)
    pieces = [piece for portion in portions for piece in tracker.front_end.process(portion)]
    for line in skipped(recording, tracker.streams):
        say(line)
    segments = [piece for piece in pieces if isinstance(piece, MeasuredSegment)]
    way_m = sum(math.hypot(s.segment.dx_m, s.segment.dy_m) for s in segments)
    if way_m < LEAST_WAY_M:
        raise EchostepError(f"{recording.path}: only {way_m:.1f} m of steps in it: walk past the walls, then draw them")
    if not any(np.isfinite(s.range_m).any() for s in segments):
        imported = recording.metadata.get("note", "").endswith("no other sensor")
        foot_alone = "it is a foot's alone, and walls are drawn from echoes"
        why = foot_alone if imported else "echostep doctor examines the rangers"
        raise EchostepError(f"{recording.path}: no echo in it: {why}")
    return segments


def _start_of(recording: Recording) -> Pose:
    """Where the drawing begins: at the recorded start if it is a pose, else at the origin of a map without a plan."""
    assert NO_PLAN.start is not None
    try:
        start = recorded_start(recording.metadata, recording.path)
    except EchostepError:
        say(f"{recording.path}: its recorded start is damaged: the drawing begins at the origin")
        return NO_PLAN.start
    return start if isinstance(start, Pose) else NO_PLAN.start


def described(mapped: Mapped, plan: Plan) -> list[str]:
    """The drawing in words."""
    walls = np.concatenate([level.heard for level in plan.levels])
    doors = [door for level in plan.levels for door in level.doors]
    length_m = _length_m(walls)
    walked_m = np.hypot(*np.diff(mapped.graph.path, axis=0).T).sum()
    opened = sum(door.state == "open" for door in doors)
    lines = [
        f"{len(walls)} walls, {length_m:.0f} m, to {100.0 * (plan.uncertainty_m or 0.0):.0f} cm (1 sd) beside the path of"
        f" {walked_m:.0f} m; {len(doors)} openings, {opened} walked through"
    ]
    places = np.concatenate([level.place_sd[:, 2] for level in plan.levels])
    if len(places):
        doubtful_m = sum(_length_m(level.doubtful) for level in plan.levels)
        lines.append(
            f"in the building the walls are known to {np.median(places):.1f} m (1 sd), the worst to {places.max():.1f} m;"
            f" {doubtful_m:.0f} m are doubtful: no second passage confirmed them, or they may be more than {OFF_M} m off"
        )
    lines += refusals(plan)
    if len(plan.levels) > 1:
        heights = ", ".join(f"{level.height_m:+.1f}" for level in plan.levels)
        lines.append(f"{len(plan.levels)} floors at {heights} m, {len(plan.connectors)} stairs")
    if mapped.directions.evidence >= LEAST_EVIDENCE:
        lines.append("walls have two directions at right angles: the heading is corrected by them")
    closures = mapped.graph.closures
    if closures:
        least = min(closure.log_odds for closure in closures) / math.log(10.0)
        lines.append(
            f"{len(closures)} returns to known places, each with odds of 10^{least:.0f} or better; {len(mapped.undone)} undone"
        )
    else:
        lines.append("no place was passed twice: the drift of the foot is in the drawing")
    return lines


def _length_m(walls: Floats) -> float:
    """Length of segments (n, 4)."""
    return float(np.hypot(*(walls[:, 2:] - walls[:, :2]).T).sum())
