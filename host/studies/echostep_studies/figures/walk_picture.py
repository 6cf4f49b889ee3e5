# SPDX-License-Identifier: MIT
"""host/pictures/walk.webp: the demo's walk on its plan, moving: truth, estimate, 95 % ellipse and particles.

In: the demo's plan and walk, the twin when it is built (`make demo` builds it). Out: one animated picture, whose description names what it was
made from (`source`). Simulated, and drawn SPEED times as fast as the walk. Owns nothing.
"""

from __future__ import annotations

import argparse
import hashlib
import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from echostep.arrays import Floats
from echostep.localization import Estimate, claims_place
from echostep.path import MeasuredSegment
from echostep.plan import Plan, load_plan
from echostep.ports.chunks import portion_of
from echostep.tracker import Tracker
from echostep_app.output.track_plot import TRACK_COLOUR, TRUTH_COLOUR
from echostep_app.scorecard.truth import Truth
from echostep_app.simulation.devices.board import Board, BoardProcess, PythonBoard
from echostep_app.simulation.scenario import DEMO_WAYPOINTS, Scenario, demo_scenario

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from PIL.Image import Image

ROOT = Path(__file__).resolve().parents[4]
PLAN = ROOT / "host/core/echostep/plans/demo.json"
PICTURE = ROOT / "host/pictures/walk.webp"
TWIN, ELF = ROOT / "tools/twin/build/echostep-twin", ROOT / "firmware/build/echostep.elf"
SEED = 1
SPEED = 6.0  # times real time: the walk of 87 s is seen in 15 s
MOST_PARTICLES = 300  # drawn
NEAR_M = 1.25  # half the side of the enlarged square
PARTICLE_COLOUR, WALL_COLOUR, NAME_COLOUR = "#e69f00", "#444444", "#888888"
IMAGE_DESCRIPTION = 0x010E  # Exif tag


@dataclass(frozen=True, slots=True)
class Moment:
    """An estimate, the particles (n, 2) that it is the mean of, and the true position then, map frame, metres."""

    estimate: Estimate
    particles_m: Floats
    truth_m: Floats


def moments(scenario: Scenario, plan: Plan) -> list[Moment]:
    """Track a simulated walk; the cloud is looked at whenever there is an estimate."""
    table = scenario.truth
    truth = Truth(table[:, 0], table[:, 1:3])
    tracker = Tracker(plan, scenario.start, seed=SEED)
    taken: list[Moment] = []

    def look(_segment: MeasuredSegment | None, estimate: Estimate) -> None:
        cloud = tracker.particles(MOST_PARTICLES)
        if cloud is not None:
            true_m = truth.at(np.array([estimate.t_s]))[0]
            taken.append(Moment(estimate, np.column_stack([cloud.x_m, cloud.y_m]), true_m))

    tracker.watchers.append(look)
    for chunk in scenario.chunks():
        tracker.take(portion_of([chunk]))
    return taken


def frames(walk: Sequence[Moment], plan: Plan) -> list[Image]:
    """One picture for each moment: the plan on the left, the surroundings of the estimate on the right."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from PIL import Image

    figure = Figure(figsize=(9.6, 3.9), dpi=100, layout="constrained")
    canvas: Any = FigureCanvasAgg(figure)
    whole, near = figure.subplots(1, 2, width_ratios=(2.05, 1.0))
    for axes in (whole, near):
        _draw_plan(axes, plan)
    whole.axis("off")
    drawn = [(axes, _artists(axes, ellipse=axes is near)) for axes in (whole, near)]
    whole.legend(loc="upper center", bbox_to_anchor=(0.5, -0.02), ncols=4, frameon=False, fontsize=10, markerscale=3)
    whole.set_title("a simulated walk", fontsize=12)
    near.set_title("error", fontsize=12)
    canvas.draw()
    figure.set_layout_engine("none")  # the layout of the first frame serves all
    pictures = []
    for k, moment in enumerate(walk):
        for _, artists in drawn:
            _update(artists, walk[: k + 1])
        x_m, y_m = moment.estimate.x_m, moment.estimate.y_m
        near.set(xlim=(x_m - NEAR_M, x_m + NEAR_M), ylim=(y_m - NEAR_M, y_m + NEAR_M))
        off_m = math.dist((x_m, y_m), moment.truth_m)
        error = f"error {off_m:.2f} m" if claims_place(moment.estimate) else "no position is claimed"
        whole.set_title(f"a simulated walk, {moment.estimate.t_s:.0f} s", fontsize=12)
        near.set_title(f"{2 * NEAR_M:g} m of it: {error}", fontsize=12)
        canvas.draw()
        pictures.append(Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB"))
    return pictures


def _draw_plan(axes: Axes, plan: Plan) -> None:
    """Walls and names of rooms of the lowest level, without a frame."""
    from matplotlib.collections import LineCollection
    from matplotlib.patheffects import withStroke

    level = plan.levels[0]
    axes.add_collection(LineCollection(list(level.solid.reshape(-1, 2, 2)), colors=WALL_COLOUR, linewidths=1.5))
    for room in level.rooms:
        axes.text(
            *room.at_m, room.name, ha="center", va="center", color=NAME_COLOUR, fontsize=9, clip_on=True, zorder=5,
            path_effects=[withStroke(linewidth=3, foreground="white")],
        )  # fmt: skip
    axes.autoscale_view()
    axes.set(aspect="equal", xticks=[], yticks=[])


def _artists(axes: Axes, *, ellipse: bool) -> dict[str, Any]:
    """What moves: lines of truth and estimate, particles, the ellipse, both positions; `ellipse`: large enough to be seen."""
    from matplotlib.patches import Ellipse

    patch = Ellipse(
        (0.0, 0.0), 0.0, 0.0, facecolor=TRACK_COLOUR, edgecolor=TRACK_COLOUR, alpha=0.3, label="95 % ellipse"
    )
    size = 4.0 if ellipse else 1.0
    return {
        "truth": axes.plot([], [], color=TRUTH_COLOUR, linewidth=4, alpha=0.5, label="truth")[0],
        "particles": axes.plot([], [], ".", color=PARTICLE_COLOUR, markersize=size, label="particles")[0],
        "ellipse": axes.add_patch(patch),
        "estimate": axes.plot([], [], color=TRACK_COLOUR, linewidth=1.2, label="estimate")[0],
        "true position": axes.plot(
            [], [], "o", color=TRUTH_COLOUR, markersize=9, markerfacecolor="none", markeredgewidth=2
        )[0],
        "position": axes.plot([], [], "o", color=TRACK_COLOUR, markersize=5)[0],
    }


def _update(artists: dict[str, Any], walked: Sequence[Moment]) -> None:
    """Move the artists to the newest moment."""
    now = walked[-1]
    shape = now.estimate.ellipse95
    claimed = np.array(
        [(m.estimate.x_m, m.estimate.y_m) if claims_place(m.estimate) else (np.nan,) * 2 for m in walked]
    )
    for name in ("position", "ellipse"):  # as on the page: without a place nothing is drawn that looks like one
        artists[name].set_visible(claims_place(now.estimate))
    artists["truth"].set_data(*np.array([m.truth_m for m in walked]).T)
    artists["estimate"].set_data(*claimed.T)
    artists["particles"].set_data(*now.particles_m.T)
    artists["true position"].set_data([now.truth_m[0]], [now.truth_m[1]])
    artists["position"].set_data([now.estimate.x_m], [now.estimate.y_m])
    artists["ellipse"].set(
        center=(now.estimate.x_m, now.estimate.y_m),
        width=2 * shape.major_m,
        height=2 * shape.minor_m,
        angle=math.degrees(shape.angle_rad),
    )


def write(path: Path, walk: Sequence[Moment], pictures: Sequence[Image], described: str) -> None:
    """The animation, repeated for ever, each picture as long as the walk took to the next one, SPEED times faster."""
    from PIL import Image

    t_s = [moment.estimate.t_s for moment in walk]
    lasting_ms = [max(20, round(1000 * (b - a) / SPEED)) for a, b in zip(t_s, t_s[1:], strict=False)] + [1500]
    exif = Image.Exif()
    exif[IMAGE_DESCRIPTION] = described
    pictures[0].save(
        path, save_all=True, append_images=pictures[1:], duration=lasting_ms, loop=0, quality=85, method=4, exif=exif
    )


def source(plan: Plan) -> str:
    """What the picture shows: changes with the plan's walls and the walk, and asks for a new one then."""
    digest = hashlib.sha256(plan.levels[0].solid.tobytes() + repr(DEMO_WAYPOINTS).encode()).hexdigest()
    return f"echostep demo, seed {SEED}, simulated; walls and way {digest[:16]}"


def main() -> int:
    """Track the demo's walk and write the picture."""
    parser = argparse.ArgumentParser(description="make the moving picture of the demo's walk")
    parser.add_argument("--out", type=Path, default=PICTURE)
    out = parser.parse_args().out
    plan = load_plan(PLAN)
    board: Board = BoardProcess([str(TWIN), "--elf", str(ELF)]) if TWIN.exists() else PythonBoard(SEED)
    scenario = demo_scenario(plan, SEED, board)
    try:
        walk = moments(scenario, plan)
    finally:
        scenario.close()
    write(out, walk, frames(walk, plan), source(plan))
    board_name = "the real firmware in the twin" if TWIN.exists() else "the Python board"
    print(f"{out}: {len(walk)} pictures, {out.stat().st_size / 1e6:.2f} MB, {board_name}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
