# SPDX-License-Identifier: MIT
"""`echostep map`: the plan of a building from a recorded walk.

In: a recording. Out: plan.json, a picture, what was found in words. Owns nothing.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from echostep.errors import EchostepError
from echostep.mapping.directions import LEAST_EVIDENCE
from echostep.mapping.mapper import Mapped, map_walk
from echostep.mapping.picture import draw_picture
from echostep.mapping.plan import plan_of
from echostep.odometry.front_end import FrontEnd
from echostep.path import MeasuredSegment
from echostep.plan.model import NO_PLAN, Plan, Pose
from echostep.plan.writer import save_plan
from echostep.recording.reading import Recording, open_recording
from echostep.session.console import console
from echostep.session.metadata import recorded_start
from echostep.session.options import TrackingOptions
from echostep.session.progress import bar, with_bar
from echostep.session.replay import tracker_of

LEAST_WAY_M = 3.0  # of path that shows a wall


def map_recording(path: Path, out: Path, picture: Path | None) -> None:
    """Draw the building of a recorded walk; raises EchostepError when there is no walk in it, or no wall was heard."""
    recording = open_recording(path)
    segments = segments_of(recording)
    with bar(f"drawing {path.name}") as show:
        mapped = map_walk(segments, show)
    start = recorded_start(recording.metadata, path)
    plan, walked_m = plan_of(mapped, start if isinstance(start, Pose) else _origin(), path.stem)
    if not plan.is_drawn:
        raise EchostepError(
            f"{path}: no walls were heard beside the path: is a ranger covered, or was it walked outside?"
        )
    save_plan(plan, out)
    if picture is not None:
        draw_picture(picture, plan, walked_m)
    for line in described(mapped, plan):
        console.print(line, markup=False, highlight=False)
    console.print(f"{out}: check and mend it with echostep plan edit {out}", markup=False, highlight=False)


def segments_of(recording: Recording) -> list[MeasuredSegment]:
    """The path of a recording with its pings; raises EchostepError when it has no steps or no echo."""
    front_end: FrontEnd = tracker_of(recording, NO_PLAN, TrackingOptions(None)).front_end
    portions = with_bar(recording.portions(), f"reading {recording.path.name}", lambda: recording.fraction)
    pieces = [piece for portion in portions for piece in front_end.process(portion)]
    segments = [piece for piece in pieces if isinstance(piece, MeasuredSegment)]
    way_m = sum(math.hypot(s.segment.dx_m, s.segment.dy_m) for s in segments)
    if way_m < LEAST_WAY_M:
        raise EchostepError(f"{recording.path}: only {way_m:.1f} m of steps in it: walk past the walls, then draw them")
    if not any(np.isfinite(s.range_m).any() for s in segments):
        raise EchostepError(f"{recording.path}: no echo in it: echostep doctor examines the rangers")
    return segments


def _origin() -> Pose:
    """Where the map begins without a plan."""
    assert NO_PLAN.start is not None
    return NO_PLAN.start


def described(mapped: Mapped, plan: Plan) -> list[str]:
    """What was drawn, in words."""
    walls, doors = plan.levels[0].walls, plan.levels[0].doors
    length_m = float(np.hypot(*(walls[:, 2:] - walls[:, :2]).T).sum())
    opened = sum(door.state == "open" for door in doors)
    lines = [
        f"{len(walls)} walls, {length_m:.0f} m, to {100.0 * (plan.uncertainty_m or 0.0):.0f} cm (1 sd) beside the path of"
        f" {mapped.graph.nodes.way_m[-1]:.0f} m; {len(doors)} openings, {opened} walked through"
    ]
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
