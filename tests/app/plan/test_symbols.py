# SPDX-License-Identifier: MIT
"""The lines of a level: each kind has its pattern, within its outline; nothing is drawn that a plan does not say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely

from echostep.arrays import Floats
from echostep.plan import NO_PLAN, Connector, ConnectorKind, Door, Level, Plan
from echostep_app.plan.pictures.symbols import HALF_JAMB_M, HALF_WINDOW_M, MOST_TREADS, level_lines, way_names

LINE = (2.0, 0.0, 3.0, 0.0)
SHAFT = np.array([(0.0, 0.0), (0.0, 5.0), (2.0, 5.0), (2.0, 0.0)])
BENT = np.array([(0.0, 0.0), (6.0, 0.0), (6.0, 2.0), (2.0, 2.0), (2.0, 4.0), (0.0, 4.0)])


def plan_of(level: Level, *connectors: Connector) -> Plan:
    levels = tuple(replace(level, name=str(k), height_m=3.0 * k) for k in range(3))
    return Plan("test", levels, None, "", connectors)


def way(kind: ConnectorKind, outline_m: Floats, levels: tuple[int, ...] = (0, 1, 2), name: str = "") -> Connector:
    return Connector(kind, name, levels, outline_m)


def rows(lines: Floats) -> set[tuple[float, ...]]:
    """Lines whatever their direction."""
    return {tuple(np.round(sorted([row[:2], row[2:]]), 6).ravel()) for row in lines.tolist()}


@pytest.mark.parametrize(
    ("state", "kind", "leaves"), [("open", "door", 0), ("closed", "door", 1), ("unknown", "unknown", 1)]
)
def test_a_door_has_its_jambs_and_a_leaf_where_it_may_be_shut(state: str, kind: str, leaves: int) -> None:
    lines = level_lines(plan_of(Level("", 0.0, np.zeros((0, 4)), doors=(Door(LINE, state),))), 0)  # type: ignore[arg-type]
    jambs = {(x, -HALF_JAMB_M, x, HALF_JAMB_M) for x in (2.0, 3.0)}
    assert rows(lines["door"]) >= jambs
    assert (LINE in rows(lines[kind])) == bool(leaves)
    assert sum(len(lines[name]) for name in lines) == 2 + leaves


def test_a_window_is_glass_between_two_faces() -> None:
    lines = level_lines(plan_of(Level("", 0.0, np.zeros((0, 4)), windows=np.array([LINE]))), 0)
    h = HALF_WINDOW_M
    assert rows(lines["window"]) == {LINE, (2, -h, 3, -h), (2, h, 3, h), (2, -h, 2, h), (3, -h, 3, h)}
    assert not len(lines["wall"])


def test_stairs_have_steps_across_their_length_and_a_lift_its_cross() -> None:
    plan = plan_of(Level("", 0.0, np.zeros((0, 4))), way("stairs", SHAFT), way("lift", SHAFT), way("ramp", SHAFT))
    lines = level_lines(plan, 1)
    outline = rows(np.array([(0, 0, 0, 5), (0, 5, 2, 5), (2, 5, 2, 0), (2, 0, 0, 0)], dtype=float))
    steps = rows(lines["stairs"]) - outline
    assert len(steps) == MOST_TREADS - 1
    assert all(y0 == y1 and (x0, x1) == (0.0, 2.0) for x0, y0, x1, y1 in steps)
    assert rows(lines["lift"]) - outline == {(0.0, 0.0, 2.0, 5.0), (0.0, 5.0, 2.0, 0.0)}
    assert (1.0, 0.0, 1.0, 5.0) in rows(lines["ramp"])


@pytest.mark.parametrize("kind", ["stairs", "lift", "ramp"])
@pytest.mark.parametrize(
    "outline_m",
    [BENT, np.array([(0.0, 0.0), (2.0, 2.0), (0.0, 2.0), (2.0, 0.0)]), np.array([(0.0, 0.0), (1.0, 1.0), (3.0, 3.0)])],
    ids=["bent", "crossing itself", "without area"],
)
def test_no_line_leaves_the_outline(kind: ConnectorKind, outline_m: Floats) -> None:
    lines = level_lines(plan_of(Level("", 0.0, np.zeros((0, 4))), way(kind, outline_m)), 0)[kind]
    within = shapely.make_valid(shapely.Polygon(outline_m)).buffer(1e-6)
    assert len(lines) >= len(outline_m)
    assert np.isfinite(lines).all()
    assert shapely.within(
        shapely.linestrings(lines.reshape(-1, 2, 2)), within.union(shapely.LinearRing(outline_m).buffer(1e-6))
    ).all()


def test_a_way_says_where_it_leads_on_its_levels_only() -> None:
    plan = plan_of(Level("", 0.0, np.zeros((0, 4))), way("stairs", SHAFT, name="Stairs A"), way("lift", BENT, (1, 2)))
    said = [[name for name, _ in way_names(plan, level)] for level in range(3)]
    assert said == [["Stairs A ↑"], ["Stairs A ↑↓", "lift ↑"], ["Stairs A ↓", "lift ↓"]]
    assert shapely.Polygon(BENT).contains(shapely.Point(way_names(plan, 2)[1][1]))
    assert not len(level_lines(plan, 0)["lift"])


def test_without_a_plan_there_are_no_lines() -> None:
    assert not any(len(lines) for lines in level_lines(NO_PLAN, 0).values())
