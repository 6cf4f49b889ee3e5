# SPDX-License-Identifier: MIT
"""Real feet in a corridor: the recordings of surveyed hallways, with echoes simulated from walls that are drawn around the footprints.

In: a `FootRecording` with a true path. Out: a `Hallway`, its chunks, `SimulatedWalk`. Owns the corridor's width. Real: the foot's inertial samples,
and every footprint. Simulated: walls, board, echoes, which belong to the true places.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely

from echostep.arrays import Floats
from echostep.board import messages as m
from echostep.board.frames import encode
from echostep.foot.steps import Step, walk_track
from echostep.plan import Plan
from echostep.ports.chunks import BOARD, MTX, Chunk
from echostep.settings import parse_settings
from echostep.xsens import MTDATA, MtSample, encode_frame, pack_mtdata
from echostep_simulation.devices.board import PythonBoard
from echostep_simulation.people.walker import RATE_HZ, Walk
from echostep_simulation.stimulus import BoardSensors
from echostep_studies.bench.recordings.feet import FootRecording, hallway
from echostep_studies.bench.sites import plan_of
from echostep_studies.bench.walks import SimulatedWalk, walk_of
from echostep_studies.frame.truth import at_times

FILES = "gx5_gcp/*_LLIO.mat"
SETTINGS = "[mtx]\nrate_hz = 200\n\n[gait]\nfoot_left_m = 0.0\n"
LONG_STEP_M = 0.8  # a longer step shows the walking direction
START_S = 1.0  # board time of the first sample
LATENCY_S = 0.0071
HALF_WIDTH_M = 1.0
STRAIGHTEN_M = 0.3  # tolerance of the simplified path: deviations of single footprints do not bend the walls
TRUTH_MS = 20


@dataclass(frozen=True)
class Hallway:
    """A real walk: `t_s` (n,) from 0; `accel`, `gyro` (n, 3) in body axes (x toe, z up); footprints: times (k,), positions (k, 2)."""

    name: str
    t_s: Floats
    accel: Floats
    gyro: Floats
    print_t_s: Floats
    print_m: Floats

    @property
    def walls(self) -> Floats:
        """Walls (n, 4) of a corridor along the straightened path."""
        path = shapely.LineString(self.print_m).simplify(STRAIGHTEN_M)
        floor = path.buffer(HALF_WIDTH_M, cap_style="square", join_style="mitre").buffer(0)
        rings = [ring for part in getattr(floor, "geoms", [floor]) for ring in (part.exterior, *part.interiors)]
        corners = [np.asarray(ring.coords) for ring in rings]
        return np.vstack([np.hstack([c[:-1], c[1:]]) for c in corners])


def names_in(data: Path) -> dict[str, Path]:
    """The recordings of surveyed hallways by name."""
    return {
        path.stem.removeprefix("SensorConnectData_").removesuffix("_LLIO"): path for path in sorted(data.glob(FILES))
    }


def read_hallway(path: Path) -> Hallway:
    """Read a recording and rotate its samples to body axes."""
    recording = next(hallway(path))
    assert recording.truth_t_s is not None
    assert recording.truth_m is not None
    t_s, mount = recording.t_s - recording.t_s[0], _mounting(recording)
    return Hallway(
        recording.name, t_s, recording.accel @ mount.T, recording.gyro @ mount.T,
        recording.truth_t_s - recording.t_s[0], recording.truth_m,
    )  # fmt: skip


def _mounting(recording: FootRecording) -> Floats:
    """Rotation (3, 3) sensor -> body: up from the first second at rest, forward from the first long steps."""
    t, accel, gyro = recording.t_s, recording.accel, recording.gyro
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
    mount: Floats = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]) @ level
    return mount


def true_walk(walk: Hallway) -> Walk:
    """The true trunk at 1 kHz: above each surveyed footprint at its time, linear in between; the board starts START_S earlier."""
    t = np.arange(int((walk.t_s[-1] + START_S) * RATE_HZ)) / RATE_HZ
    trunk = at_times(t - START_S, walk.print_t_s, walk.print_m)
    strides = np.diff(walk.print_m, axis=0)
    middle = 0.5 * (walk.print_t_s[1:] + walk.print_t_s[:-1])
    heading = np.interp(t - START_S, middle, np.unwrap(np.arctan2(strides[:, 1], strides[:, 0])))
    still = np.zeros((len(t), 3))
    rate = np.zeros(len(t))
    # No belt was recorded: its gyro is still, as those of the legs, so the foot is alone.
    return Walk(t, trunk, heading, still, still, rate, rate, rate, np.ones(len(t), bool), rate)


def chunks(walk: Hallway, plan: Plan, seed: int) -> list[Chunk]:
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


def walked_hallway(walk: Hallway, seed: int) -> SimulatedWalk:
    """A recording as the mapper gets it, with echoes of this seed."""
    plan, true = plan_of(f"hallway {walk.name}", walk.walls), true_walk(walk)
    rows = np.column_stack([true.t_s, true.trunk_m, true.heading_rad, 0.0 * true.t_s])[::TRUTH_MS]
    return walk_of(plan, chunks(walk, plan, seed), rows, parse_settings(SETTINGS, "settings"))
