# SPDX-License-Identifier: MIT
"""Public recordings of feet and trunks through the detection of falls: number of falls claimed without a fall.

In: a folder laid out like ../shared/data. Out: rows. Owns nothing. The strides, by which the standing directions are learnt, are those of the foot.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats
from echostep.foot.steps import Foot, Step
from echostep.foot.trunk_path import GaitSettings, TrunkPath
from echostep.path import PathSegment
from echostep_app.wearer.falls import STRIDE_M, Fall
from echostep_app.wearer.wearer_signs import WearerSigns
from echostep_studies.bench.recordings.feet import SETS as FEET
from echostep_studies.bench.recordings.legs import qmt_sensors
from echostep_studies.frame.recordings import Sets, read_sets
from echostep_studies.incapacity.falls import MESSAGES_HZ, NoFallRun, message_index

MOVING_M_S2 = 2.0  # of a walking chest, sum of the axes' standard deviations in a second


def recorded(folder: Path) -> list[NoFallRun]:
    """Every recording of feet and trunks, through the detection: how many falls it claims. There is none in them."""
    rows: list[NoFallRun] = []
    for foot in read_sets(folder, FEET)[0]:
        rows.append(_of_foot("recorded: feet", np.asarray(foot.t_s, np.float64), foot.accel, foot.gyro))
    for trunk in read_sets(folder, TRUNKS)[0]:
        signs = WearerSigns()
        _add_strides(signs, _strides(trunk))
        signs.add_belt(trunk.t_s, trunk.rate, trunk.force, trunk.thigh, message_index(trunk.t_s))
        rows.append(_counted("recorded: trunks", signs, trunk.t_s))
    return rows


class TrunkRecording(NamedTuple):
    """Samples of a trunk, t_s (n,), force, rate (n, 3), with the force of a thigh (n, 3), and of a foot of the same wearer, if recorded."""

    t_s: Floats
    force: Floats
    rate: Floats
    thigh: Floats
    foot: tuple[Floats, Floats] | None


def _qmt(path: Path) -> Iterator[TrunkRecording]:
    """Hip and lower back of one person, each with either leg [Laidig 2023]."""
    t_s, sensor = qmt_sensors(path)
    for place, side in (("lower_back", "left"), ("hip", "right")):
        foot = sensor(f"foot_{side}", "acc"), sensor(f"foot_{side}", "gyr")
        thigh = sensor(f"upper_leg_{side}", "acc")
        yield TrunkRecording(t_s, sensor(place, "acc"), sensor(place, "gyr"), thigh, foot)


def _chest(path: Path) -> Iterator[TrunkRecording]:
    """A chest in a walk of 97 s, without a foot; axes as the file names them."""
    table = np.genfromtxt(path, delimiter=",", skip_header=1)
    t_s = (table[:, 0] - table[0, 0]) * 1e-4
    force = table[:, [6, 4, 5]]
    yield TrunkRecording(t_s, force, table[:, [3, 1, 2]], np.full_like(force, np.nan), None)


TRUNKS: Sets[TrunkRecording] = (
    ("qmt", "legs_qmt/*.mat", _qmt),
    ("chest", "chest_mti3_biba/*_converted.csv", _chest),
)


def _of_foot(name: str, t_s: Floats, accel: Floats, gyro: Floats) -> NoFallRun:
    signs = WearerSigns()
    _add_strides(signs, _foot_strides(t_s, accel, gyro))
    signs.add_foot(t_s, gyro, accel, message_index(t_s))
    return _counted(name, signs, t_s)


def _counted(name: str, signs: WearerSigns, t_s: Floats) -> NoFallRun:
    signs.settle()
    claimed = sum(isinstance(sign, Fall) for sign in signs.pop())
    hours = float(t_s[-1] - t_s[0]) / 3600.0
    return NoFallRun(name=name, seed=0, hours=hours, claimed=claimed)


def _add_strides(signs: WearerSigns, strides: list[tuple[float, PathSegment]]) -> None:
    for known_s, segment in strides:
        signs.add_segments(int(known_s * MESSAGES_HZ), [segment])


def _strides(trunk: TrunkRecording) -> list[tuple[float, PathSegment]]:
    """Strides by the wearer's foot; without one, a stride a second for as long as the trunk moves."""
    if trunk.foot is not None:
        return _foot_strides(trunk.t_s, *trunk.foot)
    made: list[tuple[float, PathSegment]] = []
    for end_s in np.arange(1.0, trunk.t_s[-1]).tolist():
        force = trunk.force[(trunk.t_s >= end_s - 1.0) & (trunk.t_s < end_s)]
        if force.std(axis=0).sum() > MOVING_M_S2:
            segment = PathSegment(end_s - 1.0, end_s, STRIDE_M, 0.0, 0.0, 0.0, 0.01, 0.0, len(made))
            made.append((end_s, segment))
    return made


def _foot_strides(t_s: Floats, accel: Floats, gyro: Floats) -> list[tuple[float, PathSegment]]:
    """The path's segments of a foot's steps, each with the time when it is known."""
    foot = Foot().track(t_s, accel, gyro, np.full_like(accel, np.nan))
    path, made = TrunkPath(GaitSettings()), []
    for event, k in zip(foot.events, foot.sample_index.tolist(), strict=True):
        if isinstance(event, Step):
            made += [(float(t_s[k]), segment) for segment in path.add_step(event)]
        else:
            path.add_stance(event)
    return made
