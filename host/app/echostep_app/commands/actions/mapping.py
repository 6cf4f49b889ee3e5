# SPDX-License-Identifier: MIT
"""`echostep map`: the plan of a building from recorded walks.

In: recordings. Out: plan.json, a picture, what was found in words. Owns nothing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep.path import MeasuredSegment
from echostep.plan import NO_PLAN, Plan, Pose
from echostep.recording import Recording, open_recording
from echostep.walk.recorded import recorded_start
from echostep_app.mapping.graph.directions import LEAST_EVIDENCE
from echostep_app.mapping.joining import Join, join_walks
from echostep_app.mapping.known_plan import plan_as_walk
from echostep_app.mapping.mapper import Mapped, drawn, solve_walk
from echostep_app.mapping.picture import draw_picture
from echostep_app.mapping.plan import Walked, plan_of
from echostep_app.mapping.walls.completion import complete
from echostep_app.mapping.walls.place_sd import OFF_M
from echostep_app.plan.importers.limited import open_limited
from echostep_app.plan.places.refusals import refusals
from echostep_app.plan.writer import save_plan
from echostep_app.printing.lines import say
from echostep_app.printing.progress import bar, with_bar
from echostep_app.session.losses import skipped
from echostep_app.session.options import TrackingOptions
from echostep_app.session.runs.replay import tracker_of

PLAN_SD_M = 0.05  # of the walls of a plan that does not state it
LEAST_WAY_M = 3.0  # of path that shows a wall
WALK_START = "0,0,90"  # of the walk that is drawn: the recorded start moves the drawing afterwards


def map_recordings(paths: Sequence[Path], plan_path: Path | None, out: Path, picture: Path | None) -> None:
    """Draw the building of recorded walks, or complete a plan of it; raises EchostepError.

    Raised when a recording is no walk, cannot be placed on the others or on the plan, or has no echo of a wall.
    """
    _check_files(paths, out, picture)
    known = None if plan_path is None else open_limited(plan_path)
    recordings = [open_recording(path) for path in paths]
    walks = [(str(recording.path), _solved(recording)) for recording in recordings]
    if known is None:
        plan, walked_m, lines = _drawn(walks, _start_of(recordings[0]), paths[0].stem)
    else:
        plan, walked_m, lines = _completed(known, str(plan_path), walks)
    save_plan(plan, out)
    if picture is not None:
        draw_picture(picture, plan, walked_m)
        lines.append(f"picture: {picture}")
    for line in [*lines, f"{out}: check and mend it with echostep plan edit {out}"]:
        say(line)


Walks = Sequence[tuple[str, Mapped]]
Result = tuple[Plan, Walked, list[str]]


def _drawn(walks: Walks, start: Pose, name: str) -> Result:
    """The plan that the walks show, their paths on it, and what was found."""
    joins: tuple[Join, ...] = ()
    if len(walks) > 1:
        with bar(f"joining {len(walks)} walks") as show:
            mapped, joins = join_walks(walks, show)
    else:
        mapped = drawn(walks[0][1])
    plan, walked_m = plan_of(mapped, start, name)
    if not plan.is_drawn and not refusals(plan):
        raise EchostepError(
            f"{walks[0][0]}: no walls were heard beside the path: is a ranger covered, or was it walked outside?"
        )
    return plan, walked_m, [*described(mapped, plan), *(_join_line(join) for join in joins)]


def _completed(known: Plan, name: str, walks: Walks) -> Result:
    """The plan, completed and corrected on the level that the walks fit."""
    refused: list[EchostepError] = []
    for k, level in enumerate(known.levels):
        try:
            with bar(f"placing {len(walks)} walks on {level.name}") as show:
                mapped, joins = join_walks(
                    [(name, plan_as_walk(level, known.uncertainty_m or PLAN_SD_M)), *walks], show
                )
        except EchostepError as error:
            refused.append(error)
            continue
        done = complete(level, mapped.graph, mapped.pings, mapped.drawing)
        levels = tuple(done.level if i == k else other for i, other in enumerate(known.levels))
        summary = f"{name}, {level.name}: {done.new_m:.0f} m of wall added, {done.doubtful_m:.0f} m doubtful: echoes passed them"
        walked_m = tuple(mapped.drawing.paths_m if i == k else () for i in range(len(levels)))
        return replace(known, levels=levels), walked_m, [summary, *(_join_line(join) for join in joins)]
    raise refused[0]


def _solved(recording: Recording) -> Mapped:
    """The path of one recording, corrected."""
    segments = segments_of(recording)
    with bar(f"drawing {recording.path.name}") as show:
        return solve_walk(segments, show)


def _check_files(paths: Sequence[Path], out: Path, picture: Path | None) -> None:
    """Raises EchostepError where what is written would replace a recording, or a walk is given twice."""
    walks = [path.resolve() for path in paths]
    for k, path in enumerate(paths):
        if walks[k] in walks[:k]:
            raise EchostepError(f"{path}: this walk is given twice")
    for written in (out, picture):
        if written is not None and written.resolve() in walks:
            raise EchostepError(f"{written}: this is the recording: give the result another name")


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
        why = (
            "it is a foot's alone, and walls are drawn from echoes"
            if imported
            else "echostep doctor examines the rangers"
        )
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
    """What was drawn, in words."""
    walls = np.concatenate([level.heard for level in plan.levels])
    doors = [door for level in plan.levels for door in level.doors]
    length_m = _length_m(walls)
    walked_m = sum(np.hypot(*np.diff(path, axis=0).T).sum() for path in mapped.graph.paths())
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


def _join_line(join: Join) -> str:
    """How a walk was joined, in words."""
    least = min(closure.log_odds for closure in join.closures) / math.log(10.0)
    return (
        f"{join.name} joined on {join.place.common_m:.0f} m of common wall, odds of its place 10^{join.place.log_odds / math.log(10.0):.0f};"
        f" {len(join.closures)} returns between the walks, each with odds of 10^{least:.0f} or better"
    )
