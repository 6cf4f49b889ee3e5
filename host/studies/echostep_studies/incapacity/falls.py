# SPDX-License-Identifier: MIT
"""The detection of falls, judged: which simulated falls are told, how soon, and what else is taken for one.

In: seeds. Out: rows (recordings: `fall_recordings.py`). The samples are simulated (`studies/echostep_studies/simulation/falling.py`); from
them on it is the tracker's own code. The wearer rests without a movement after everything that is no fall, which is harder than life.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.odometry.incapacity.alarm import AlarmKind, AlarmReason, WearerAlarm
from echostep.odometry.incapacity.falls import Fall
from echostep.odometry.incapacity.wearer_signs import Sign, WearerSigns
from echostep.output.table import Table
from echostep.path import PathSegment
from echostep_studies.frame.report import Row, rows_by_name
from echostep_studies.simulation.body_motion import ICM20649, MTX, Part
from echostep_studies.simulation.falling import FALLS, NO_FALLS, STRIDE_M, BodySamples, walk_then

KITS = ("belt", "foot board alone", "MTx alone")
MESSAGES_HZ = 1e4  # indices of messages, in order of time


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


def fallen(seed: int) -> Row:
    """A wearer who falls and stays: whether it is told, how soon after the fall began, and whether the walk before it was taken for one."""
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
    early = sum(isinstance(sign, Fall) and sign.told_s <= samples.event_s for sign in signs)
    times = {"asked_s": began.get(AlarmKind.ASKING), "mayday_s": began.get(AlarmKind.MAYDAY)}
    return {"name": f"{kit}: {manner}", "seed": seed, "fell": 1, "early": early, **times}


def not_fallen(seed: int) -> Row:
    """A wearer who does something else that is sudden, and then rests: whether a fall was claimed."""
    kit, manner = _drawn(seed, list(NO_FALLS))
    samples = walk_then(NO_FALLS[manner], _foot(kit), np.random.default_rng([seed, 4]))
    claimed = sum(isinstance(sign, Fall) for sign in signs_of(samples, belt=kit == "belt"))
    return {"name": f"{kit}: {manner}", "seed": seed, "fell": 0, "claimed": claimed}


def _drawn(seed: int, manners: list[str]) -> tuple[str, str]:
    return KITS[seed % len(KITS)], manners[seed // len(KITS) % len(manners)]


def _foot(kit: str) -> Part:
    return MTX if kit == "MTx alone" else ICM20649


def summarize(rows: Sequence[Row]) -> list[Row]:
    """One row for each kit and manner, in order of the kits; recordings last."""
    made: list[Row] = []
    for group in rows_by_name(rows):
        row: Row = {"name": group[0]["name"], "runs": len(group)}
        if group[0].get("fell"):
            asked, maydays = ([r[key] for r in group if r[key] is not None] for key in ("asked_s", "mayday_s"))
            row |= {"told": len(asked), "early": sum(r["early"] for r in group)}
            row |= {"median_s": float(np.median(asked)), "longest_s": max(asked)} if asked else {}
            row |= {"mayday_s": max(maydays)} if maydays else {}
        else:
            row |= {"claimed": sum(r["claimed"] for r in group)}
            row |= {"watched_h": sum(r["hours"] for r in group)} if "hours" in group[0] else {}
        made.append(row)
    return sorted(made, key=lambda row: [*KITS, "recorded"].index(row["name"].split(":")[0]))


def tables(rows: Sequence[Row]) -> list[Table]:
    """Tables of the rows of `summarize`."""
    fell = {
        "name": "", "runs": "falls", "told": "told as a fall", "early": "claims before", "median_s": "asked after, median s",
        "longest_s": "longest s", "mayday_s": "mayday after, longest s",
    }  # fmt: skip
    rest = {"name": "", "runs": "runs", "watched_h": "hours", "claimed": "falls claimed"}
    return [
        Table("Falls (simulated)", [row for row in rows if "told" in row], fell),
        Table("What is no fall (simulated, recordings real)", [row for row in rows if "claimed" in row], rest),
    ]
