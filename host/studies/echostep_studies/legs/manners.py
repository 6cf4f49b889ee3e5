# SPDX-License-Identifier: MIT
"""The rows `legs/upstairs`, ...: manners of moving that two gyros in the plane of the leg do not show, or only in part.

In: seeds. Out: a row a manner: true and estimated way forward and up, the error over its stated deviation, the strides' flags. Owns the
manners: curves of thigh and knee, assumed where `leg_angles` has none. The signs of the gyros are known, as from a walk before.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from echostep.arrays import Floats
from echostep.legs.stride import Flag, Stride
from echostep_app.offline.leg_side import distance_sd_m
from echostep_app.output.table import Table
from echostep_simulation.people.leg_angles import LegDimensions, stair_angles
from echostep_simulation.people.rolling_foot import glide
from echostep_studies.frame.parts import Part
from echostep_studies.frame.report import Row, means, named
from echostep_studies.frame.study import StudyRequest
from echostep_studies.legs.people import strides_of

CYCLES, RATE_HZ, STAND_S, EASE_S = 15, 100.0, 2.0, 0.8
AMPLITUDE_SD, TIME_SD = 0.08, 0.05  # of a person against the curves
BIAS_RAD_S, NOISE_RAD_S = 0.02, 0.01  # sd
SWING = (0.60, 1.0)  # phases of a leg in the air
STAIRS = Flag.STAIRS_UP | Flag.STAIRS_DOWN
BLIND = Flag.UNSEEN | Flag.BACKWARD | Flag.STANDING
FIGURES = ("forward_m", "found_m", "sd_m", "error_over_sd", "up_m", "rise_m", "stairs_percent", "blind_percent")
COLUMNS = {
    "name": "", "forward_m": "forward m", "found_m": "found m", "sd_m": "sd m", "error_over_sd": "error / sd", "up_m": "up m", "rise_m": "rise m",
    "stairs_percent": "stairs %", "blind_percent": "unseen %",
}  # fmt: skip

Angles = Callable[[Floats], tuple[Floats, Floats]]


@dataclass(frozen=True, slots=True)
class LegManner:
    """`angles`: thigh and shank (rad, forward positive) at phases of a cycle of `cycle_s`, in which the hips go `forward_m` and `up_m`.

    `posture_rad`: thigh and shank in between, which are taken before the first cycle.
    """

    angles: Angles
    cycle_s: float
    forward_m: float
    up_m: float = 0.0
    posture_rad: tuple[float, float] = (0.0, 0.0)


def lifted(thigh_deg: float, knee_deg: float) -> Angles:
    """A leg that is lifted in its swing and put down where it was: thigh and knee flex by so much."""

    def angles(phase: Floats) -> tuple[Floats, Floats]:
        share = np.clip((phase % 1.0 - SWING[0]) / (SWING[1] - SWING[0]), 0.0, 1.0)
        bump = np.sin(np.pi * share) ** 2
        return math.radians(thigh_deg) * bump, math.radians(thigh_deg - knee_deg) * bump

    return angles


def kneeling(phase: Floats) -> tuple[Floats, Floats]:
    """Crawling on hands and knees: the thigh swings 20 degrees either way about the vertical, the shank lies behind."""
    return math.radians(20.0) * np.sin(2.0 * np.pi * phase), math.radians(4.0) * np.sin(2.0 * np.pi * phase)


MANNERS = {
    "upstairs": LegManner(lambda phase: stair_angles(phase, up=True), 1.3, 0.57, 0.34),
    "downstairs": LegManner(lambda phase: stair_angles(phase, up=False), 1.2, 0.57, -0.34),
    "sidestepping": LegManner(lifted(8.0, 20.0), 1.1, 0.0),
    "crawling": LegManner(kneeling, 1.3, 0.59, posture_rad=(0.0, math.radians(-90.0))),
    "up a ladder": LegManner(lifted(55.0, 80.0), 1.5, 0.0, 0.56),
    "down a ladder": LegManner(lifted(50.0, 85.0), 1.5, 0.0, -0.56),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class MannerRun:
    """One manner of moving, measured by a leg: true and estimated way forward and upward, and the flags of the strides."""

    name: str
    seed: int
    forward_m: float
    found_m: float
    sd_m: float
    error_over_sd: float
    up_m: float
    rise_m: float
    stairs_percent: float
    blind_percent: float


def manner_rows(names: Sequence[str], seed: int) -> list[MannerRun]:
    """CYCLES of each of these manners by one person, from standing to standing."""
    return [_row(name, MANNERS[name.removeprefix("legs/")], seed) for name in names]


def _row(name: str, manner: LegManner, seed: int) -> MannerRun:
    rng = np.random.default_rng([seed, 71])
    strides = _strides(manner, rng)
    moved = [s for s in strides if Flag.STANDING not in s.flags]
    forward = CYCLES * manner.forward_m
    measured_m, sd = sum(s.length_m for s in strides), distance_sd_m(strides)
    return MannerRun(
        name=name, seed=seed, forward_m=forward, found_m=measured_m, sd_m=sd,
        error_over_sd=(measured_m - forward) / sd if sd > 0.0 else math.nan,
        up_m=CYCLES * manner.up_m, rise_m=sum(s.rise_m for s in strides),
        stairs_percent=_share(moved, STAIRS), blind_percent=_share(moved, BLIND),
    )  # fmt: skip


def _strides(manner: LegManner, rng: np.random.Generator) -> list[Stride]:
    """Strides of one person with gyros of their own biases."""
    amplitude, time = 1.0 + AMPLITUDE_SD * rng.standard_normal(), 1.0 + TIME_SD * rng.standard_normal()
    walk_s = CYCLES * manner.cycle_s * time
    posture_s = EASE_S if any(manner.posture_rad) else 0.0
    t_s = np.arange(0.0, walk_s + 2.0 * (STAND_S + posture_s + EASE_S), 1.0 / RATE_HZ)
    begin = STAND_S + posture_s
    moves = glide((t_s - begin) / EASE_S) * glide((begin + walk_s - t_s) / EASE_S)
    down = glide((t_s - STAND_S) / EASE_S) * glide((begin + walk_s + EASE_S - t_s) / EASE_S) if posture_s else 0.0 * t_s
    curves = manner.angles((t_s - begin) / (manner.cycle_s * time))
    rates = []
    for curve, posture in zip(curves, manner.posture_rad, strict=True):
        rate = np.gradient(posture * down + amplitude * moves * curve) * RATE_HZ
        rates.append(rate + BIAS_RAD_S * rng.standard_normal() + NOISE_RAD_S * rng.standard_normal(len(t_s)))
    return strides_of(LegDimensions(), t_s, rates[0], rates[1], (1.0, 1.0))


def _share(strides: list[Stride], flags: Flag) -> float:
    """Share (percent) of the strides with any of these flags."""
    return 100.0 * sum(bool(s.flags & flags) for s in strides) / len(strides) if strides else 0.0


def _tables(rows: list[Row], request: StudyRequest) -> list[Table]:
    title = f"One leg alone, {CYCLES} cycles, {request.runs} runs, simulated"
    return [Table(title, [row for row in rows if "rise_m" in row], COLUMNS)]


PART = Part(
    [f"legs/{name}" for name in MANNERS],
    manner_rows,
    {MannerRun: lambda group: named(group) | means(group, FIGURES)},
    _tables,
)
