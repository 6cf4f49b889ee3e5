# SPDX-License-Identifier: MIT
"""Public recordings of legs with gyros of three axes, read from a folder laid out like ../shared/data.

In: the folder. Out: `LegRecording`s, the names of sets that are not there, and of files that could not be read. Owns nothing. Each leg is a recording
of its own. The truth is what both feet have gone from stance to stance, by their inertial tracks (`foot.steps`) or by motion capture of the ankles:
so that sway to and fro is no way.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from echostep.arrays import Floats, spans
from echostep.foot.steps import walk_track
from echostep.legs.kinematics import LegLengths
from echostep_studies.frame.recordings import Sets

WAY_HZ = 10.0  # of the feet's path: slow enough that the noise of standing markers adds nothing
PAUSE_S = 3.0  # feet that rest for longer end a walk
MOVING_M_S = 0.1  # mean speed of both feet over `PAUSE_S` in a walk; assumed
SMOOTHED = 5  # samples of motion capture, against its noise
STANDS_M_S, STANDS_S = 0.3, 0.08  # of an ankle in a stance, which turns on about the heel and the ball; assumed
Move = tuple[float, float, Floats]  # begin and end s, x and y m
MARGIN_S = 1.0  # of standing, kept before and after the walk


@dataclass(frozen=True, slots=True)
class LegRecording:
    """Samples `t_s` (n,), rates `thigh`, `shank` (n, 3) in rad/s in each sensor's own frame, `belt` (n,) positive to the left.

    `way_m` (m,): distance gone at `way_s` (m,), the mean of both feet. `lengths`: of the leg, where they were measured.
    """

    group: str
    name: str
    t_s: Floats
    thigh: Floats
    shank: Floats
    belt: Floats
    way_s: Floats
    way_m: Floats
    lengths: LegLengths | None = None

    def walked_m(self, begin_s: float, end_s: float) -> float:
        """True distance between two times."""
        begin, end = np.interp([begin_s, end_s], self.way_s, self.way_m).tolist()
        return float(end - begin)

    def walk_s(self) -> tuple[float, float]:
        """Begin and end of the longest walk, with the standing beside it: not what the feet do before or after."""
        back = np.interp(self.way_s - 0.5 * PAUSE_S, self.way_s, self.way_m)
        on = np.interp(self.way_s + 0.5 * PAUSE_S, self.way_s, self.way_m)
        moving = np.concatenate([[False], (on - back) > MOVING_M_S * PAUSE_S, [False]])
        edges = np.flatnonzero(np.diff(moving.astype(np.int8))).reshape(-1, 2)
        begin, end = max(edges.tolist(), key=lambda e: self.way_m[min(e[1], len(self.way_m) - 1)] - self.way_m[e[0]])
        last = len(self.way_s) - 1
        return float(self.way_s[begin]) - MARGIN_S, float(self.way_s[min(end, last)]) + MARGIN_S


def qmt_sensors(path: Path) -> tuple[Floats, Callable[[str, str], Floats]]:
    """Times (n,) of a file of qmt, and what gives the samples (n, 3) of a part and a sensor [Laidig 2023]."""
    from scipy.io import loadmat

    mat: dict[str, Any] = loadmat(path)
    return mat["t"].ravel(), lambda part, name: np.asarray(mat[part][name][0, 0], np.float64)


def _qmt(path: Path) -> Iterator[LegRecording]:
    """One person, both legs, feet and lower back, 100 s [Laidig 2023]; the truth is the feet's inertial tracks."""
    t_s, sensor = qmt_sensors(path)
    feet = [walk_track(t_s, sensor(f"foot_{k}", "acc"), sensor(f"foot_{k}", "gyr")) for k in ("left", "right")]
    way_s = np.arange(t_s[0], t_s[-1], 1.0 / WAY_HZ)
    ways = [
        _way_by_moves(way_s, [(s.t_start_s, s.t_end_s, np.array(s.move_m[:2])) for s in foot.steps]) for foot in feet
    ]
    belt = sensor("lower_back", "gyr")[:, 0]  # x is up
    for side in ("left", "right"):
        thigh, shank = (sensor(f"{part}_{side}", "gyr") for part in ("upper_leg", "lower_leg"))
        yield LegRecording("qmt", side, t_s, thigh, shank, belt, way_s, np.mean(ways, axis=0))


def _gait_toolbox(path: Path) -> Iterator[LegRecording]:
    """One person, both legs and pelvis, with motion capture [Sy 2020]. The rates are in the sensors' own frames, whatever the headers say."""
    columns = _columns(path, "PELV_1")
    t_s = np.arange(len(columns["PELV_1"])) / 100.0
    way_s = np.arange(t_s[0], t_s[-1], 1.0 / WAY_HZ)

    def marker(name: str) -> Floats:
        return np.column_stack([columns[f"{name}_{k}"] for k in (1, 2, 3)])

    def gyro(part: str) -> Floats:
        rates = _columns(path.with_name(path.name.replace("vicon", part)), "ori_1")
        return np.column_stack([rates[f"gyr_{k}"] for k in (1, 2, 3)])

    way = np.mean([_way_by_moves(way_s, moves_of(t_s, marker(name)[:, :2])) for name in ("LTIO", "RTIO")], axis=0)
    belt = gyro("Pelvis")[:, 0]  # x is up
    for side, name in (("L", "left"), ("R", "right")):
        hip, knee, ankle = (marker(side + point) for point in ("FEP", "FEO", "TIO"))
        lengths = LegLengths(_mean_length(hip - knee), _mean_length(knee - ankle))
        thigh, shank = gyro(f"{side}_UpLeg"), gyro(f"{side}_LowLeg")
        trial = path.stem.removesuffix("-vicon")
        yield LegRecording("gaittoolbox", f"{trial}, {name}", t_s, thigh, shank, belt, way_s, way, lengths)


def _columns(path: Path, first: str) -> dict[str, Floats]:
    """The columns of a CSV file whose header, which begins with the column `first`, follows comments."""
    lines = [line for line in path.read_text().splitlines() if not line.startswith("//")]
    names = lines[0].split(",")
    if names[0] != first:
        raise ValueError(f"the first column is {names[0]}, not {first}")
    table = np.array([line.split(",") for line in lines[1:]], np.float64)
    return dict(zip(names, table.T, strict=True))


def moves_of(t_s: Floats, places_m: Floats) -> list[Move]:
    """The moves of an ankle between its stances, from its places (n, 2) by motion capture at t_s (n,), evenly sampled."""
    even = np.ones(SMOOTHED) / SMOOTHED
    slow = [np.convolve(np.pad(column, SMOOTHED // 2, "edge"), even, "valid") for column in places_m.T]
    stands = np.hypot(*np.gradient(slow, t_s, axis=1)) < STANDS_M_S
    stances = [(a, b) for a, b in spans(stands).tolist() if t_s[b - 1] - t_s[a] > STANDS_S]
    places = [places_m[a:b].mean(axis=0) for a, b in stances]
    return [
        (float(t_s[end - 1]), float(t_s[begin]), later - place)
        for (_, end), (begin, _), place, later in zip(stances, stances[1:], places, places[1:], strict=False)
    ]


def _way_by_moves(way_s: Floats, moves: list[Move]) -> Floats:
    """Distance (m,) gone by a foot at the times way_s (m,): its moves from stance to stance, each at an even pace."""
    knots = [(-np.inf, 0.0)]
    for start_s, end_s, move_m in moves:
        gone = knots[-1][1]
        knots += [(start_s, gone), (end_s, gone + float(np.hypot(*move_m)))]
    return np.interp(way_s, *np.array(knots[1:]).T)


def _mean_length(between: Floats) -> float:
    return float(np.linalg.norm(between, axis=1).mean())


SETS: Sets[LegRecording] = (
    ("qmt", "legs_qmt/*.mat", _qmt),
    ("gaittoolbox", "legs_gaittoolbox/*-vicon.csv", _gait_toolbox),
)
