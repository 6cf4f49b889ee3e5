# SPDX-License-Identifier: MIT
"""Simulated walks of the experiments of [Lee 2010], and what the host measures on them.

In: a seed, which chooses the person. Out: `Walk`s, the bytes of the simulated board, `MeasuredWalk`. Owns the routes. Frames, clock and counts are
read as in a live run.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from echostep.arrays import Floats
from echostep.board import messages as m
from echostep.board.calibration import ADIS16100_RAD_S
from echostep.board.frames import BoardReader, Frames, encode
from echostep.legs.kinematics import LegLengths
from echostep.plan import Level, Plan
from echostep.ports.chunks import BOARD, Chunk
from echostep.timing.timeline import PLAIN, Arrivals, MtxTiming, Timeline
from echostep_app.offline.leg_csv import LegSamples
from echostep_simulation.devices.board import PythonBoard
from echostep_simulation.people.leg_angles import LegDimensions
from echostep_simulation.people.walker import Person, Walk, Waypoint, walk
from echostep_simulation.stimulus import BoardSensors
from echostep_simulation.world.magnetic_field import MagneticField

LAP: tuple[Waypoint, ...] = ((0.0, 0.0), (40.0, 0.0), (40.0, 30.0), (0.0, 30.0), (0.0, 0.0))  # [Lee 2010, Figure 6]
CORRIDOR_M, STOREY_M, STOREYS = 80.0, 3.5, 5  # [Lee 2010, Figure 7]; the storey's height is not printed
BLOCK_MS = 1000
HALF_WIDE_M = 1.0  # of the corridor
START_NS = 1_000_000_000
NO_PINGS = m.Sensors.THIGH | m.Sensors.CALF | m.Sensors.BELT | m.Sensors.COMPASS | m.Sensors.PRESSURE
TAPE_SD_M = 0.01  # of a thigh or a shank measured by tape


@dataclass(frozen=True, slots=True)
class MeasuredWalk:
    """Host's data of a walk: `samples` of gyros and compass, `pressure` (n, 2) t_s and Pa, lengths of the leg `segments` as measured."""

    samples: LegSamples
    pressure: Floats
    segments: LegLengths


def person_of(seed: int) -> Person:
    """Legs, stride and pace of a healthy adult [Winter 2009; Perry 1992]."""
    rng = np.random.default_rng([seed, 30])
    height = rng.uniform(1.55, 1.92)
    leg = LegDimensions(0.245 * height * rng.uniform(0.96, 1.04), 0.246 * height * rng.uniform(0.96, 1.04))
    stride = 0.78 * height * rng.uniform(0.9, 1.08)
    return Person(stride_m=stride, stride_s=1.1 * rng.uniform(0.93, 1.12), leg=leg)


def lap_of(seed: int) -> Walk:
    """Once round 40 x 30 m."""
    return walk(LAP, person_of(seed), np.random.default_rng([seed, 31]))


def descent_of(seed: int) -> Walk:
    """From the 5th floor down to the 1st, along each corridor."""
    return walk(descent_waypoints(), person_of(seed), np.random.default_rng([seed, 32]))


def descent_waypoints() -> list[Waypoint]:
    """Corridors of 80 m to and fro, a stairwell of two flights at the end of each."""
    way: list[Waypoint] = [(0.0, 0.0, 0.0, (STOREYS - 1) * STOREY_M)]
    for k in range(STOREYS):
        z, y, on = (STOREYS - 1 - k) * STOREY_M, 1.6 * k, 1.0 if k % 2 == 0 else -1.0
        end = CORRIDOR_M if on > 0.0 else 0.0
        way.append((end, y, 0.0, z))
        if k + 1 < STOREYS:
            half, low = z - 0.5 * STOREY_M, z - STOREY_M
            for x, dy, at in ((1.0, 0.0, z), (4.2, 0.0, half), (5.0, 0.8, half), (4.2, 1.6, half), (1.0, 1.6, low)):
                way.append((end + on * x, y + dy, 0.0, at))
    return way


def lap_plan() -> Plan:
    """The corridor that the lap goes through, 2 m wide, with doors set back by 20 cm at no regular places."""
    rng = np.random.default_rng(40)
    walls: list[tuple[float, ...]] = []
    for off in (-HALF_WIDE_M, HALF_WIDE_M):
        box = np.array([(-off, -off), (40.0 + off, -off), (40.0 + off, 30.0 + off), (-off, 30.0 + off)])
        for a, b in zip(box, np.roll(box, -1, axis=0), strict=True):
            walls += _with_doors(a, b, 0.2 if off > 0.0 else -0.2, rng)
    return Plan("lap", (Level("0", 0.0, np.array(walls)),), None, "lap of Lee 2010")


def _with_doors(a: Floats, b: Floats, deep_m: float, rng: np.random.Generator) -> list[tuple[float, ...]]:
    """A wall from a to b, with doors about every 6 m; positive: set back to its right."""
    length = float(np.hypot(*(b - a)))
    along = (b - a) / length
    right = deep_m * np.array([along[1], -along[0]])
    points = [a]
    for at in np.arange(2.0, length - 4.0, 6.0) + rng.uniform(0.0, 3.0, len(np.arange(2.0, length - 4.0, 6.0))):
        first, last = a + at * along, a + (at + 0.9) * along
        points += [first, first + right, last + right, last]
    points.append(b)
    return [(*p.tolist(), *q.tolist()) for p, q in zip(points, points[1:], strict=False)]


def chunks_of(walked: Walk, levels: Sequence[Level], seed: int) -> list[Chunk]:
    """The bytes of a board that is worn on this walk, as they reach the host; pings where there are walls."""
    magnetism = MagneticField(np.random.default_rng([seed, 34]))
    sensors = BoardSensors(walked, levels, np.empty(0), np.random.default_rng([seed, 35]), magnetism)
    board = PythonBoard(seed=seed)
    if not len(levels[0].walls):
        board.send(encode(m.Configure(NO_PINGS, m.Schedule.CONCURRENT, 200, 10, m.PressureMode.HIGH_SPEED), 0))
    gathered: dict[int, bytes] = {}
    for start in range(0, len(walked.t_s), BLOCK_MS):
        for t_ns, part in board.advance(sensors.rows(start, min(start + BLOCK_MS, len(walked.t_s)))):
            gathered[t_ns] = gathered.get(t_ns, b"") + part
    return [Chunk(BOARD, START_NS + t_ns, part) for t_ns, part in gathered.items()]


def storeys() -> list[Level]:
    """Five floors without walls."""
    return [Level(str(k), k * STOREY_M, np.empty((0, 4))) for k in range(STOREYS)]


def measure(chunks: Sequence[Chunk], seed: int) -> MeasuredWalk:
    """What the host reads of the board's bytes, and the wearer's legs by tape."""
    leg = person_of(seed).leg
    tape = TAPE_SD_M * np.random.default_rng([seed, 33]).standard_normal(2)
    segments = LegLengths(leg.thigh_m + tape[0], leg.shank_m + tape[1])
    return replace(_read(b"".join(chunk.data for chunk in chunks)), segments=segments)


def _read(received: bytes) -> MeasuredWalk:
    """Frames, one clock, SI units."""
    reader = BoardReader()
    frames = reader.frames(received)
    t_s, gyros = _timed(frames, m.Gyros)
    at, compass = _timed(frames, m.Compass)
    heading = np.full(len(t_s), np.nan)
    good = compass["bearing"] < 3600
    place = np.minimum(np.searchsorted(t_s, at[good]), len(t_s) - 1)
    angle = 0.5 * math.pi - np.radians(0.1 * compass["bearing"][good])
    heading[place] = np.arctan2(np.sin(angle), np.cos(angle))
    thigh, calf, belt = (
        np.where(gyros[name] == m.GYROS_INVALID, np.nan, gyros[name] * ADIS16100_RAD_S)
        for name in ("thigh", "calf", "belt")
    )
    pressure_s, pressure = _timed(frames, m.Pressure)
    table = np.column_stack([pressure_s, 0.25 * pressure["pressure"]])[
        pressure["pressure"] != m.PRESSURE_PRESSURE_INVALID
    ]
    whole = np.isfinite(t_s) & np.isfinite(thigh) & np.isfinite(calf) & np.isfinite(belt)
    samples = LegSamples(t_s[whole], thigh[whole], calf[whole], belt[whole], heading[whole])
    return MeasuredWalk(samples, table, LegLengths())


def _timed(frames: Frames, kind: type[m.Message]) -> tuple[Floats, NDArray[np.void]]:
    """The messages of a kind with their times."""
    _, rows = frames.rows(kind)
    ticks = rows["ticks"].astype(np.int64)
    n, none = len(ticks), np.empty(0, np.int64)
    arrived = ticks * 500 + START_NS
    board = Arrivals(ticks, np.arange(n), arrived, np.full(n, PLAIN))
    times = Timeline(MtxTiming()).times(board, Arrivals(none, none, none, none))
    return times.board_s, rows


def start_of(walked: Walk) -> tuple[float, float, float]:
    """Place and heading at the beginning."""
    x, y = walked.trunk_m[0].tolist()
    return x, y, float(walked.heading_rad[0])
