# SPDX-License-Identifier: MIT
"""Evaluation of the fall detection: share and delay of detected simulated falls, and false detections in other movements.

In: seeds. Out: rows (recordings: `fall_recordings.py`). The samples are simulated (`studies/echostep_studies/simulation/falling.py`); from
them on it is the tracker's own code. The wearer rests without a movement after everything that is no fall, which is harder than life.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from msgspec import UNSET, UnsetType

from echostep.arrays import Floats, Ints
from echostep.odometry import AlarmKind, AlarmReason
from echostep.path import PathSegment
from echostep_app.output.table import Table
from echostep_app.wearer.alarm import WearerAlarm
from echostep_app.wearer.falls import Fall
from echostep_app.wearer.wearer_signs import Sign, WearerSigns
from echostep_studies.frame.report import Row, Summaries, as_dicts, named
from echostep_studies.simulation.body_motion import ICM20649, MTX, SensorPart
from echostep_studies.simulation.falling import FALLS, NO_FALLS, STRIDE_M, BodySamples, walk_then

KITS = ("belt", "foot board alone", "MTx alone")
MESSAGES_HZ = 1e4  # indices of messages, in order of time


@dataclass(frozen=True, slots=True, kw_only=True)
class FallRun:
    """A fall: how soon after it began the wearer was asked, and others were called; `early`: falls claimed before it."""

    name: str
    seed: int
    early: int
    asked_s: float | None
    mayday_s: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class NoFallRun:
    """What is no fall: how many were claimed; `hours` of a recording."""

    name: str
    seed: int
    hours: float | UnsetType = UNSET
    claimed: int


def signs_of(samples: BodySamples, *, belt: bool) -> list[Sign]:
    """The tracker's signs of the wearer from samples of foot and, if `belt`, of belt and thigh."""
    signs = WearerSigns()
    foot = samples.foot
    signs.add_foot(foot.t_s, foot.rate, foot.force, message_index(foot.t_s))
    if belt:
        t_s = samples.belt.t_s
        signs.add_belt(t_s, samples.belt.rate, samples.belt.force, samples.thigh.force, message_index(t_s))
    for k, (t0_s, t1_s) in enumerate(samples.strides.tolist()):
        signs.add_segments(int(t1_s * MESSAGES_HZ), [PathSegment(t0_s, t1_s, STRIDE_M, 0.0, 0.0, 0.0, 0.01, 0.0, k)])
    signs.settle()
    return signs.pop()


def message_index(t_s: Floats) -> Ints:
    """Indices (n,) of the messages that bring the samples of these times."""
    return np.floor(t_s * MESSAGES_HZ).astype(np.int64)


def fallen(seed: int) -> FallRun:
    """A fall of a wearer that stays down: whether it is detected, the delay from its beginning, and whether the walk before gave a false one."""
    kit, manner = _drawn(seed, list(FALLS))
    samples = walk_then(FALLS[manner], _foot(kit), np.random.default_rng([seed, 3]))
    signs = signs_of(samples, belt=kit == "belt")
    alarm = WearerAlarm()
    alarm.add(signs)
    began = {
        change.kind: t_s - samples.event_s
        for t_s, change in alarm.changes
        if change and change.reason is AlarmReason.FALL
    }
    early = sum(isinstance(sign, Fall) and sign.known_s <= samples.event_s for sign in signs)
    asked_s, mayday_s = began.get(AlarmKind.ASKING), began.get(AlarmKind.MAYDAY)
    return FallRun(name=f"{kit}: {manner}", seed=seed, early=early, asked_s=asked_s, mayday_s=mayday_s)


def not_fallen(seed: int) -> NoFallRun:
    """Another sudden movement, followed by rest: whether a fall was detected."""
    kit, manner = _drawn(seed, list(NO_FALLS))
    samples = walk_then(NO_FALLS[manner], _foot(kit), np.random.default_rng([seed, 4]))
    claimed = sum(isinstance(sign, Fall) for sign in signs_of(samples, belt=kit == "belt"))
    return NoFallRun(name=f"{kit}: {manner}", seed=seed, claimed=claimed)


def _drawn(seed: int, manners: list[str]) -> tuple[str, str]:
    return KITS[seed % len(KITS)], manners[seed // len(KITS) % len(manners)]


def _foot(kit: str) -> SensorPart:
    return MTX if kit == "MTx alone" else ICM20649


def _told(group: Sequence[FallRun]) -> Row:
    asked = [row.asked_s for row in group if row.asked_s is not None]
    maydays = [row.mayday_s for row in group if row.mayday_s is not None]
    return named(group) | {
        "told": len(asked), "early": sum(row.early for row in group),
        "median_s": float(np.median(asked)) if asked else UNSET, "longest_s": max(asked, default=UNSET),
        "mayday_s": max(maydays, default=UNSET),
    }  # fmt: skip


def _claimed(group: Sequence[NoFallRun]) -> Row:
    hours = [row.hours for row in group if row.hours is not UNSET]
    claimed = sum(row.claimed for row in group)
    return named(group) | {"claimed": claimed, "watched_h": sum(hours) if hours else UNSET}


SUMMARIES: Summaries = {FallRun: _told, NoFallRun: _claimed}


def tables(rows: Sequence[Row]) -> list[Table]:
    """Tables of the summary rows of falls, and of what is none."""
    fell = {
        "name": "", "runs": "falls", "told": "told as a fall", "early": "claims before", "median_s": "asked after, median s",
        "longest_s": "longest s", "mayday_s": "mayday after, longest s",
    }  # fmt: skip
    rest = {"name": "", "runs": "runs", "watched_h": "hours", "claimed": "falls claimed"}
    return [
        Table("Falls (simulated)", as_dicts(row for row in rows if "early" in row), fell),
        Table(
            "What is no fall (simulated, recordings real)",
            as_dicts(row for row in rows if "claimed" in row),
            rest,
        ),
    ]
