# SPDX-License-Identifier: MIT
"""The study of operations on a short one, and the manners of moving of the simulated walker."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from echostep_simulation.people.walker import Manner, Person, walk
from echostep_simulation.world.tower import STOREY_M, stairs_from, tower
from echostep_studies.frame.study import StudyRequest, run_study
from echostep_studies.operation import study
from echostep_studies.operation.walks import CHANGE_S, MANNERS, operation, waypoints


@pytest.mark.parametrize("manner", {m.name: m for m in MANNERS}.values(), ids=lambda m: m.name)
def test_the_body_faces_where_the_manner_says(manner: Manner) -> None:
    """Backward: against the way; sidestep: across it; the speed is that of the strides."""
    found = walk([(0.0, 0.0), (12.0, 0.0)], Person(manners=(manner,)), np.random.default_rng(1))
    velocity = np.gradient(found.trunk_m, axis=0) * 1000.0
    speed = np.hypot(*velocity.T)
    fast = speed > 0.6 * manner.stride_m / manner.stride_s
    off = np.arctan2(velocity[fast, 1], velocity[fast, 0]) - found.heading_rad[fast] + manner.facing_rad
    assert abs(np.median((off + math.pi) % (2.0 * math.pi) - math.pi)) < 0.03
    assert np.median(speed[fast]) == pytest.approx(manner.stride_m / manner.stride_s, rel=0.12)


def test_without_manners_people_walk_as_before() -> None:
    way = [(0.0, 0.0), (8.0, 0.0), (8.0, 5.0)]
    plain, named = (
        walk(way, Person(manners=manners), np.random.default_rng(4)) for manners in ((), (Manner("walk", 1.3, 1.1),))
    )
    assert np.array_equal(plain.foot_m, named.foot_m)
    assert np.array_equal(plain.heading_rad, named.heading_rad)


def test_stairs_are_walked() -> None:
    found = walk([(5.0, 1.5), *stairs_from(0, up=True)], Person(manners=MANNERS[1:2]), np.random.default_rng(1))
    assert [name for _, name in found.manners] == ["walk"]
    assert found.height_m[-1] == STOREY_M


def test_the_battery_is_changed_at_a_stop() -> None:
    way, stop = waypoints(tower(3), 3, 30.0)
    assert way[stop][2:3] > (CHANGE_S,)
    assert 0 < stop < len(way) - 1
    assert all(len(w) == 4 for w in way)


@pytest.mark.long
def test_a_short_operation(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Both trackers give estimates, none during the change; the rows are complete and the parts add up."""
    walked = operation(5, 12.0)
    monkeypatch.setattr(study, "operation", lambda *_: walked)
    assert walked.before[-1].t_s < walked.restart_s - CHANGE_S + 1.0
    assert walked.after[0].t_s > walked.restart_s - 1.0
    run_study(study.operation_study(12.0), StudyRequest(1, 5, tmp_path / "rows.json", tmp_path))
    rows = {row["name"]: row for row in json.loads((tmp_path / "rows.json").read_text())["rows"]}
    whole = rows["all"]
    assert set(study.COLUMNS) <= set(whole)
    assert whole["points"] == rows["known start"]["points"] + rows["unknown start"]["points"]
    manners = [rows[m]["points"] for m in {m.name for m in MANNERS} if m in rows]
    assert rows["known start"]["points"] == sum(manners)
    assert rows["known start"]["ce95_m"] < 0.5
    assert rows["known start"]["floor_tied"] == 1.0
    assert rows["all, resumed"]["points"] == rows["known start"]["points"] + rows["resumed"]["points"]
    assert rows["resumed"]["floor_tied"] == 1.0
    assert rows["resumed"]["ce95_m"] < rows["unknown start"]["ce95_m"]
