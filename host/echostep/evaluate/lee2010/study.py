"""The three experiments of [Lee 2010] in simulation: a lap of 40 x 30 m, the way down from the 5th floor to the 1st, the 3D track; theirs and ours.

In: seeds. Out: rows `lap/lee2010`, `lap/default`, `lap/default+plan`, `floors`, `storeys`, `storeys/default`; pictures as its Figures 6, 7, 8.
Owns the routes.
Everything is simulated, from the bytes of the simulated board on: frames, clock and counts are read as live. Each run is another person in another
magnetic field. All methods are given the place and the heading of the start, and the wearer's legs to within a centimetre; with the plan the wearer
is calibrated by a walk of 10 m before.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from echostep.arrays import Floats
from echostep.board import messages as m
from echostep.board.calibration import ADIS16100_RAD_S
from echostep.board.frames import BoardReader, Frames, encode
from echostep.evaluate.study import Row, Study, console, print_table, write_json, write_parquet
from echostep.legs.kinematics import LegLengths
from echostep.legs.strides import StrideSettings
from echostep.legs.trunk_path import WearerSettings
from echostep.offline.leg_csv import LegSamples, track_default
from echostep.papers import lee2010
from echostep.plan.model import Level, Plan, Pose
from echostep.ports.chunks import BOARD, Chunk, portion_of
from echostep.settings import Settings
from echostep.simulation.devices.board import PythonBoard
from echostep.simulation.people.leg_angles import LegDimensions
from echostep.simulation.people.walker import Person, Walk, Waypoint, walk
from echostep.simulation.stimulus import BoardSensors
from echostep.simulation.world.magnetic_field import Magnetism
from echostep.timing.timeline import PLAIN, Arrivals, MtxTiming, Timeline
from echostep.tracker import Tracker

LAP: tuple[Waypoint, ...] = ((0.0, 0.0), (40.0, 0.0), (40.0, 30.0), (0.0, 30.0), (0.0, 0.0))  # [Lee 2010, Figure 6]
CORRIDOR_M, STOREY_M, STOREYS = 80.0, 3.5, 5  # [Lee 2010, Figure 7]; the storey's height is not printed
PRINTED: tuple[Row, ...] = ({"name": "lap, the paper", "ending_m": 8.0},)
BLOCK_MS = 1000
CALIBRATION_M = 10.0
HALF_WIDE_M = 1.0  # of the corridor
START_NS, PORTION = 1_000_000_000, 1000
NO_PINGS = m.Sensors.THIGH | m.Sensors.CALF | m.Sensors.BELT | m.Sensors.COMPASS | m.Sensors.PRESSURE
TAPE_SD_M = 0.01  # of a thigh or a shank that somebody measures
KNOWN_S = 2.0  # of standing on the floor where the walk begins: its pressure is the reference
COLUMNS = {
    "name": "", "ending_m": "ending", "ending_max_m": "worst", "mean_m": "mean", "distance_error_percent": "way %", "floor_right": "floor right",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Measured:
    """What the host has: the gyros' and the compass's `samples`, `pressure` (n, 2) t_s and Pa, the wearer's `segments` as measured."""

    samples: LegSamples
    pressure: Floats
    segments: LegLengths


@dataclass(frozen=True, slots=True)
class Found:
    """A method's track (n, 3) t_s, x, y from the true start on, and how far it says that he walked."""

    track: Floats
    distance_m: float


def evaluate_lee2010(runs: int, seed: int, json_path: Path | None, out: Path, scheduler: str | None) -> None:
    """Run the study, print its table beside the paper's figure, and write JSON, Parquet and pictures."""
    from echostep.evaluate.lee2010.pictures import draw

    each = Study("lee2010", runs, seed, one_run, out, scheduler).rows()
    rows = [
        _summary([row for row in each if row["name"] == name]) for name in dict.fromkeys(row["name"] for row in each)
    ]
    print_table(
        f"Lee and Lee 2010: {runs} simulated runs, metres; last, the paper's one real lap", [*rows, *PRINTED], COLUMNS
    )
    console.print(
        "ending, mean: error of the place at the end and on the way; way: error of the distance walked. Simulated."
    )
    write_parquet(out / "lee2010.parquet", each)
    draw(out, seed)
    if json_path is not None:
        write_json(json_path, "lee2010", runs, seed, rows)


def one_run(seed: int) -> list[Row]:
    """All rows of one person."""
    lap, plan = lap_of(seed), lap_plan()
    chunks = chunks_of(lap, plan.levels, seed)
    measured = measure(chunks, seed)
    rows = [_row(f"lap/{name}", name, seed, lap, method(measured, start_of(lap))) for name, method in METHODS.items()]
    rows.append(_row("lap/default+plan", "default", seed, lap, with_plan(plan, chunks, measured, start_of(lap), seed)))
    descent = descent_of(seed)
    measured = measure(chunks_of(descent, storeys(), seed), seed)
    floors = floors_of(measured.pressure)
    right = {"floor_right": floor_right(floors, descent)}
    for name, method in METHODS.items():
        shown = "storeys" if name == "lee2010" else f"storeys/{name}"
        rows.append(_row(shown, name, seed, descent, method(measured, start_of(descent))) | right)
    rows.append({"name": "floors", "profile": "lee2010", "seed": seed, **right, **_heights_off(floors, descent)})
    return rows


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
    magnetism = Magnetism(np.random.default_rng([seed, 34]))
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


def measure(chunks: Sequence[Chunk], seed: int) -> Measured:
    """What the host reads of the board's bytes, and the wearer's legs by tape."""
    leg = person_of(seed).leg
    tape = TAPE_SD_M * np.random.default_rng([seed, 33]).standard_normal(2)
    segments = LegLengths(leg.thigh_m + tape[0], leg.shank_m + tape[1])
    return replace(_read(b"".join(chunk.data for chunk in chunks)), segments=segments)


def _read(received: bytes) -> Measured:
    """Frames, one clock, SI units."""
    reader = BoardReader()
    frames = reader.frames(received)
    t_s, gyros = _timed(frames, m.Gyros)
    at, compass = _timed(frames, m.Compass)
    heading = np.full(len(t_s), np.nan)
    good = compass["bearing"] < 3600
    place = np.minimum(np.searchsorted(t_s, at[good]), len(t_s) - 1)
    heading[place] = _wrapped(0.5 * math.pi - np.radians(0.1 * compass["bearing"][good]))
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
    return Measured(samples, table, LegLengths())


def _timed(frames: Frames, kind: type[m.Message]) -> tuple[Floats, NDArray[np.void]]:
    """The messages of a kind with their times."""
    identifier = next(i for i, one in m.BY_ID.items() if one is kind)
    _, rows = frames.rows(identifier)
    ticks = rows["ticks"].astype(np.int64)
    n, none = len(ticks), np.empty(0, np.int64)
    arrived = ticks * 500 + 1_000_000_000
    board = Arrivals(ticks, np.arange(n), arrived, np.full(n, PLAIN))
    times = Timeline(MtxTiming()).times(board, Arrivals(none, none, none, none))
    return times.board_s, rows


def start_of(walked: Walk) -> tuple[float, float, float]:
    """Place and heading at the beginning."""
    x, y = walked.trunk_m[0].tolist()
    return x, y, float(walked.heading_rad[0])


def by_lee(measured: Measured, start: tuple[float, float, float]) -> Found:
    """The paper's method: its equations at 10 Hz."""
    s = measured.samples
    settings = lee2010.LeeSettings(legs=lee2010.Lee2010Legs(measured.segments.thigh_m, measured.segments.shank_m))
    walker = lee2010.Walker(settings)
    walker.heading = lee2010.Fused(start[2], 0.0)
    rows = walker.feed(s.t_s, s.thigh, s.shank, s.belt, s.compass)
    return Found(np.column_stack([rows[:, 0], rows[:, 4] + start[0], rows[:, 5] + start[1]]), float(rows[-1, 1]))


def by_default(measured: Measured, start: tuple[float, float, float]) -> Found:
    """Ours."""
    rows = track_default(measured.samples, StrideSettings(measured.segments), start[2]).rows[::20]
    return Found(np.column_stack([rows[:, 0], rows[:, 4] + start[0], rows[:, 5] + start[1]]), float(rows[-1, 1]))


def scale_of(segments: LegLengths, seed: int) -> float:
    """What `echostep calibrate` finds of this person on 10 m straight on."""
    walked = walk(((0.0, 0.0), (CALIBRATION_M, 0.0)), person_of(seed), np.random.default_rng([seed, 36]))
    measured = measure(chunks_of(walked, storeys()[:1], seed), seed)
    return CALIBRATION_M / float(track_default(measured.samples, StrideSettings(segments), 0.0).rows[-1, 1])


def with_plan(
    plan: Plan, chunks: Sequence[Chunk], measured: Measured, start: tuple[float, float, float], seed: int
) -> Found:
    """Ours on the plan: the tracker with the board's bytes alone, legs and pings and no foot."""
    scale = scale_of(measured.segments, seed)
    wearer = WearerSettings(measured.segments.thigh_m, measured.segments.shank_m, scale)
    tracker = Tracker(plan, Pose(*start), Settings(wearer=wearer), seed)
    portions = (portion_of(chunks[k : k + PORTION]) for k in range(0, len(chunks), PORTION))
    track = np.array([(e.t_s, e.x_m, e.y_m) for portion in portions for e in tracker.take(portion)])
    return Found(track, float(np.hypot(*np.diff(track[:, 1:], axis=0).T).sum()))


METHODS = {"lee2010": by_lee, "default": by_default}


def floors_of(pressure: Floats) -> Floats:
    """(n, 2) t_s and number of the floor from 0, by the paper's rule, when the first reading's floor is known: the highest."""
    heights = [k * STOREY_M for k in range(STOREYS)]
    reference = float(np.median(pressure[pressure[:, 0] < pressure[0, 0] + KNOWN_S, 1]))
    floors = [lee2010.floor_of(p, heights, reference, STOREYS - 1) for p in pressure[:, 1].tolist()]
    return np.column_stack([pressure[:, 0], floors])


def floor_right(floors: Floats, walked: Walk) -> float:
    """Share of the readings with the floor that is nearest in truth."""
    return float((floors[:, 1] == np.rint(_height_at(floors[:, 0], walked) / STOREY_M)).mean())


def _heights_off(floors: Floats, walked: Walk) -> Row:
    """Error of the height that is put out, which is the floor's own, at the end and on the way."""
    off = np.abs(floors[:, 1] * STOREY_M - _height_at(floors[:, 0], walked))
    return {"ending_m": float(off[-1]), "mean_m": float(off.mean())}


def _height_at(t_s: Floats, walked: Walk) -> Floats:
    return np.interp(t_s, walked.t_s, walked.height_m)


def _row(name: str, profile: str, seed: int, walked: Walk, found: Found) -> Row:
    truth = np.column_stack([np.interp(found.track[:, 0], walked.t_s, walked.trunk_m[:, k]) for k in (0, 1)])
    off = np.hypot(*(found.track[:, 1:] - truth).T)
    way = float(np.hypot(*np.diff(walked.foot_m[::50, :2], axis=0).T).sum())
    return {
        "name": name, "profile": profile, "seed": seed, "ending_m": float(off[-1]), "mean_m": float(off.mean()),
        "distance_error_percent": 100.0 * (found.distance_m / way - 1.0),
    }  # fmt: skip


def _summary(rows: list[Row]) -> Row:
    """Means over the runs, and the worst ending."""
    found: Row = {"name": rows[0]["name"], "profile": rows[0]["profile"], "runs": len(rows)}
    for key in ("ending_m", "mean_m", "distance_error_percent", "floor_right"):
        if key in rows[0]:
            found[key] = round(sum(row[key] for row in rows) / len(rows), 4)
    found["ending_max_m"] = round(max(row["ending_m"] for row in rows), 4)
    return found


def _wrapped(angle_rad: Floats) -> Floats:
    return np.arctan2(np.sin(angle_rad), np.cos(angle_rad))
