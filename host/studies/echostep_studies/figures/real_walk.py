# SPDX-License-Identifier: MIT
"""Tracks a real recorded foot on a plan drawn around its path, and prints the error (`make real`).

Real: the foot's inertial samples (walk GX5 33, 200 Hz), and every footprint, surveyed with a ruler. Simulated: the plan, a corridor 2 m wide along
the surveyed path, and the echoes from its walls at the true positions. The recording and every output state this.

In: the folder of recordings ($ECHOSTEP_DATA or ../shared/data). Out: walk.mcap, plan.json, truth.csv, settings.toml, track.png in the folder given by
--out, and the 2D RMSE at the stride points, for the foot alone and for the tracker.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from pathlib import Path

import numpy as np
from rich.console import Console

from echostep.arrays import Floats
from echostep.foot.steps import Step, walk_track
from echostep.localization import Estimate, digest
from echostep.plan import Pose, load_plan
from echostep.recording import open_recording
from echostep.settings import parse_settings
from echostep.tracker import Tracker
from echostep.walk.table import write_track
from echostep_app.output.track_plot import draw_track
from echostep_app.scorecard.track_columns import load_path
from echostep_app.session.metadata import start_recording
from echostep_studies.bench.recordings.foot_metrics import rmse
from echostep_studies.bench.recordings.hallways import (
    LONG_STEP_M,
    SETTINGS,
    START_S,
    Hallway,
    chunks,
    names_in,
    read_hallway,
)
from echostep_studies.frame.recordings import DATA
from echostep_studies.frame.truth import at_times

NAME = "GX5 33"
NOTE = "foot real (GX5 33, surveyed footprints); plan drawn around the surveyed path, echoes simulated from it at the true positions"
TARGET_M = 0.30  # largest RMSE that passes
console = Console(soft_wrap=True)  # each message stays on one line, whatever the width of the terminal


def write_files(out: Path, walk: Hallway, seed: int) -> None:
    """Write plan.json, truth.csv, settings.toml and walk.mcap."""
    out.mkdir(parents=True, exist_ok=True)
    first = walk.print_m[1] - walk.print_m[0]
    (x, y), heading_deg = walk.print_m[0].tolist(), math.degrees(math.atan2(first[1], first[0]))
    start = {"x": x, "y": y, "heading_deg": heading_deg}
    level = {"name": "corridor", "height_m": 0.0, "walls": np.round(walk.walls, 3).tolist()}
    plan = {"echostep_plan": 1, "name": f"Corridor drawn around {NAME}", "levels": [level], "start": start}
    (out / "plan.json").write_text(json.dumps(plan, indent=1) + "\n")
    (out / "settings.toml").write_text(SETTINGS)
    truth = np.column_stack([START_S + walk.print_t_s, walk.print_m])
    np.savetxt(out / "truth.csv", truth, delimiter=",", header="t_s,x,y", comments="", fmt="%.6f")
    loaded = load_plan(out / "plan.json")
    assert loaded.start is not None
    pose = f"{loaded.start.x_m!r},{loaded.start.y_m!r},{loaded.start.heading_rad!r}"
    about = {"note": NOTE, "start_x_y_rad": pose, "seed": str(seed), "settings_toml": SETTINGS}
    with start_recording(out / "walk.mcap", about | {"plan_sha256": loaded.digest}) as recorder:
        for chunk in chunks(walk, loaded, seed):
            recorder.write(chunk)


def track(out: Path, seed: int) -> tuple[list[Estimate], float]:
    """Replay the recording; returns the estimates and the computing time, s."""
    plan = load_plan(out / "plan.json")
    tracker = Tracker(plan, None, parse_settings(SETTINGS, "settings"), seed)
    began = time.perf_counter()
    estimates = [e for portion in open_recording(out / "walk.mcap").portions() for e in tracker.take(portion)]
    return estimates, time.perf_counter() - began


def rmse_at_prints(walk: Hallway, t_s: Floats, xy_m: Floats) -> float:
    """2D RMSE (m) at the footprints' times of positions xy_m (n, 2) given at t_s (n,); map frame, no alignment."""
    return float(np.sqrt(((at_times(walk.print_t_s, t_s, xy_m) - walk.print_m) ** 2).sum(1).mean()))


def foot_alone(walk: Hallway, start: Pose) -> tuple[float, float]:
    """RMSE (m) of the foot's track alone, from the given start, and after the best rigid alignment (the metric of published results)."""
    foot = walk_track(walk.t_s, walk.accel, walk.gyro)
    steps = [e for e in foot.events if isinstance(e, Step) and math.hypot(*e.move_m[:2]) > LONG_STEP_M][:1]
    turn = start.heading_rad - math.atan2(steps[0].move_m[1], steps[0].move_m[0])
    c, s = math.cos(turn), math.sin(turn)
    xy = foot.position_m[:, :2] @ np.array([[c, s], [-s, c]]) + [start.x_m, start.y_m]
    return rmse_at_prints(walk, walk.t_s, xy), rmse(at_times(walk.print_t_s, walk.t_s, xy), walk.print_m)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--out", type=Path, default=Path("out/real"), metavar="DIR")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    if not (DATA / "gx5_gcp").is_dir():
        console.print(
            f"skipped: no recordings in {DATA} (or $ECHOSTEP_DATA): host/studies/README.md says where they come from"
        )
        return 0
    walk = read_hallway(names_in(DATA)[NAME.removeprefix("GX5 ")])
    write_files(options.out, walk, options.seed)
    plan = load_plan(options.out / "plan.json")
    assert plan.start is not None
    track(options.out, options.seed)  # compiles the kernels before the measurement
    estimates, elapsed_s = track(options.out, options.seed)
    t_s = np.array([e.t_s for e in estimates]) - START_S
    error_m = rmse_at_prints(walk, t_s, np.array([(e.x_m, e.y_m) for e in estimates]))
    from_start_m, aligned_m = foot_alone(walk, plan.start)
    write_track(options.out / "track.csv", estimates)
    title = f"{NAME}: real foot, echoes simulated; RMSE {error_m:.2f} m at the surveyed footprints"
    draw_track(options.out / "track.png", plan, estimates, load_path(options.out / "truth.csv", plan), title)
    console.print(f"{NAME}: {NOTE}.")
    console.print(f"2D RMSE at the {len(walk.print_t_s)} stride points, map frame, no alignment:")
    console.print(f"  foot alone       {from_start_m:.2f} m   ({aligned_m:.2f} m after rigid alignment)")
    console.print(
        f"  plan and echoes  {error_m:.2f} m   (target {TARGET_M:.2f} m: {'met' if error_m <= TARGET_M else 'missed'})"
    )
    console.print(
        f"{walk.t_s[-1]:.0f} s in {elapsed_s:.2f} s: {walk.t_s[-1] / elapsed_s:.0f} x real time; sha256 {digest(estimates)[:16]}"
    )
    return 0 if error_m <= TARGET_M else 1


if __name__ == "__main__":
    raise SystemExit(main())
