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
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely
from rich.console import Console
from scipy.io import loadmat

from echostep.arrays import Floats
from echostep.board import messages as m
from echostep.board.frames import encode
from echostep.evaluate.feet.metrics import align, rmse
from echostep.foot.steps import Step, walk_track
from echostep.localization.estimate import Estimate, digest
from echostep.localization.metrics import load_truth
from echostep.output.track_plot import draw_track, write_track
from echostep.plan.model import Plan, Pose, load_plan
from echostep.ports.chunks import BOARD, MTX, Chunk
from echostep.recording.reading import open_recording
from echostep.session.recording import start_recording
from echostep.settings import parse_settings
from echostep.simulation.devices.board import PythonBoard
from echostep.simulation.people.walker import RATE_HZ, Walk
from echostep.simulation.stimulus import BoardSensors
from echostep.tracker import Tracker
from echostep.xsens import MTDATA, MtSample, encode_frame, pack_mtdata
from recordings import DATA

NAME = "GX5 33"
NOTE = "foot real (GX5 33, surveyed footprints); plan drawn around the surveyed path, echoes simulated from it at the true positions"
MTX_RATE_HZ = 200
TARGET_M = 0.30  # largest RMSE that passes
LONG_STEP_M = 0.8  # a longer step shows the walking direction
START_S = 1.0  # board time of the first sample
LATENCY_S = 0.0071
HALF_WIDTH_M = 1.0
STRAIGHTEN_M = 0.3  # tolerance of the simplified path: deviations of single footprints do not bend the walls
SETTINGS = f"[mtx]\nrate_hz = {MTX_RATE_HZ}\n\n[gait]\nfoot_left_m = 0.0\n"
console = Console(soft_wrap=True)  # each message stays on one line, whatever the width of the terminal


@dataclass(frozen=True)
class Recorded:
    """The real walk: `t_s` (n,) from 0; `accel`, `gyro` (n, 3) in body axes (x toe, z up); footprints: times (k,), positions (k, 2)."""

    t_s: Floats
    accel: Floats
    gyro: Floats
    print_t_s: Floats
    print_m: Floats


def read_walk(folder: Path) -> Recorded:
    """Read GX5 33 and rotate its samples to body axes; y of the footprints is negated, since their frame has z down."""
    mat = loadmat(folder / "gx5_gcp/SensorConnectData_33_LLIO.mat")
    t, imu = mat["timestamps"].ravel(), mat["imu_data"]
    stride_index = mat["strideIndex"].ravel().astype(int) - 1
    mount = mounting(t, imu[:, :3], imu[:, 3:])
    prints = mat["GCP"][:, :2] * [1.0, -1.0]
    return Recorded(
        t - t[0], imu[:, :3] @ mount.T, imu[:, 3:] @ mount.T, t[np.minimum(stride_index, len(t) - 1)] - t[0], prints
    )


def mounting(t: Floats, accel: Floats, gyro: Floats) -> Floats:
    """Rotation (3, 3) sensor -> body: up from the first second at rest, forward from the first long steps."""
    up = accel[t - t[0] < 1.0].mean(0)
    up /= np.linalg.norm(up)
    side = np.cross(up, [1.0, 0.0, 0.0])
    side /= np.linalg.norm(side)
    level = np.stack([np.cross(side, up), side, up])
    steps = [e for e in walk_track(t, accel @ level.T, gyro @ level.T).events if isinstance(e, Step)]
    long = [e for e in steps if math.hypot(*e.move_m[:2]) > LONG_STEP_M][:5]
    headings = np.array([math.atan2(e.move_m[1], e.move_m[0]) - e.heading_rad for e in long])
    turn = math.atan2(np.sin(headings).mean(), np.cos(headings).mean())
    c, s = math.cos(turn), math.sin(turn)
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]) @ level


def corridor(prints: Floats) -> Floats:
    """Walls (n, 4) of a corridor along the straightened path."""
    path = shapely.LineString(prints).simplify(STRAIGHTEN_M)
    floor = path.buffer(HALF_WIDTH_M, cap_style="square", join_style="mitre").buffer(0)
    rings = [ring for part in getattr(floor, "geoms", [floor]) for ring in (part.exterior, *part.interiors)]
    corners = [np.asarray(ring.coords) for ring in rings]
    return np.vstack([np.hstack([c[:-1], c[1:]]) for c in corners])


def true_walk(walk: Recorded) -> Walk:
    """The true trunk at 1 kHz: above each surveyed footprint at its time, linear in between; the board starts START_S earlier."""
    t = np.arange(int((walk.t_s[-1] + START_S) * RATE_HZ)) / RATE_HZ
    trunk = np.column_stack([np.interp(t - START_S, walk.print_t_s, walk.print_m[:, k]) for k in (0, 1)])
    strides = np.diff(walk.print_m, axis=0)
    middle = 0.5 * (walk.print_t_s[1:] + walk.print_t_s[:-1])
    heading = np.interp(t - START_S, middle, np.unwrap(np.arctan2(strides[:, 1], strides[:, 0])))
    still = np.zeros((len(t), 3))
    rate = np.zeros(len(t))
    belt = np.gradient(heading) * RATE_HZ
    return Walk(t, trunk, heading, still, still, rate, rate, belt, np.ones(len(t), bool), rate)


def chunks(walk: Recorded, plan: Plan, seed: int) -> list[Chunk]:
    """Chunks of both ports in order of arrival."""
    rng = np.random.default_rng([seed, 9])
    truth = true_walk(walk)
    sync_t_s = START_S + walk.t_s
    sensors = BoardSensors(truth, plan.levels, sync_t_s, rng)
    board = PythonBoard(seed)
    board.send(encode(m.Configure(m.Sensors.RANGER_LEFT | m.Sensors.RANGER_RIGHT | m.Sensors.SYNC, 0, 10, 1, 0), 0))
    arrived = []
    for start in range(0, len(truth.t_s), 50):
        arrived += [
            Chunk(BOARD, t_ns + 1_000_000, sent) for t_ns, sent in board.advance(sensors.rows(start, start + 50))
        ]
    samples = zip(sync_t_s.tolist(), walk.accel.tolist(), walk.gyro.tolist(), strict=True)
    for n, (t, accel, gyro) in enumerate(samples):
        sample = MtSample(n & 0xFFFF, tuple(accel), tuple(gyro), (0.4, 0.0, -0.9), (1.0, 0.0, 0.0, 0.0))
        arrived.append(Chunk(MTX, round((t + LATENCY_S) * 1e9), encode_frame(MTDATA, pack_mtdata(sample))))
    return sorted(arrived, key=lambda chunk: chunk.t_arrival_ns)


def write_files(out: Path, walk: Recorded, seed: int) -> None:
    """Write plan.json, truth.csv, settings.toml and walk.mcap."""
    out.mkdir(parents=True, exist_ok=True)
    first = walk.print_m[1] - walk.print_m[0]
    start = {
        "x": walk.print_m[0, 0],
        "y": walk.print_m[0, 1],
        "heading_deg": math.degrees(math.atan2(first[1], first[0])),
    }
    level = {"name": "corridor", "height_m": 0.0, "walls": np.round(corridor(walk.print_m), 3).tolist()}
    plan = {"echostep_plan": 1, "name": f"Corridor drawn around {NAME}", "levels": [level], "start": start}
    (out / "plan.json").write_text(json.dumps(plan, indent=1) + "\n")
    (out / "settings.toml").write_text(SETTINGS)
    truth = np.column_stack([START_S + walk.print_t_s, walk.print_m])
    np.savetxt(out / "truth.csv", truth, delimiter=",", header="t_s,x,y", comments="", fmt="%.6f")
    loaded = load_plan(out / "plan.json")
    assert loaded.start is not None
    pose = f"{loaded.start.x_m!r},{loaded.start.y_m!r},{loaded.start.heading_rad!r}"
    about = {
        "note": NOTE,
        "start_x_y_rad": pose,
        "seed": str(seed),
        "settings_toml": SETTINGS,
        "plan_sha256": loaded.digest,
    }
    with start_recording(out / "walk.mcap", about) as recorder:
        for chunk in chunks(walk, loaded, seed):
            recorder.write(chunk)


def track(out: Path, seed: int) -> tuple[list[Estimate], float]:
    """Replay the recording; returns the estimates and the computing time, s."""
    plan = load_plan(out / "plan.json")
    tracker = Tracker(plan, None, parse_settings(SETTINGS, "settings"), seed)
    began = time.perf_counter()
    estimates = [e for portion in open_recording(out / "walk.mcap").portions() for e in tracker.take(portion)]
    return estimates, time.perf_counter() - began


def rmse_at_prints(walk: Recorded, t_s: Floats, xy_m: Floats) -> float:
    """2D RMSE (m) at the footprints' times of positions xy_m (n, 2) given at t_s (n,); map frame, no alignment."""
    at_prints = np.column_stack([np.interp(walk.print_t_s, t_s, xy_m[:, k]) for k in (0, 1)])
    return float(np.sqrt(((at_prints - walk.print_m) ** 2).sum(1).mean()))


def foot_alone(walk: Recorded, start: Pose) -> tuple[float, float]:
    """RMSE (m) of the foot's track alone, from the given start, and after the best rigid alignment (the metric of published results)."""
    foot = walk_track(walk.t_s, walk.accel, walk.gyro)
    steps = [e for e in foot.events if isinstance(e, Step) and math.hypot(*e.move_m[:2]) > LONG_STEP_M][:1]
    turn = start.heading_rad - math.atan2(steps[0].move_m[1], steps[0].move_m[0])
    c, s = math.cos(turn), math.sin(turn)
    xy = foot.position_m[:, :2] @ np.array([[c, s], [-s, c]]) + [start.x_m, start.y_m]
    at_prints = np.column_stack([np.interp(walk.print_t_s, walk.t_s, xy[:, k]) for k in (0, 1)])
    return rmse_at_prints(walk, walk.t_s, xy), rmse(align(at_prints, walk.print_m), walk.print_m)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--out", type=Path, default=Path("out/real"), metavar="DIR")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    if not (DATA / "gx5_gcp").is_dir():
        console.print(f"skipped: no recordings in {DATA} (set ECHOSTEP_DATA)")
        return 0
    walk = read_walk(DATA)
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
    draw_track(options.out / "track.png", plan, estimates, load_truth(options.out / "truth.csv"), title)
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
