# SPDX-License-Identifier: MIT
"""Doubts about an imported plan, as questions for a person: the editor shows them, and takes an answer by one click.

In: a `Plan` with the questions of its importer. Out: the plan with the questions that follow from its check, its doors and its gaps. Owns which
findings a person can answer, and how many are asked.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import replace
from itertools import chain

import shapely

from echostep.plan import Level, Plan, Question
from echostep_app.plan.check import check_plan
from echostep_app.plan.places.faces import OUTSIDE
from echostep_app.plan.places.findings import PlanFinding
from echostep_app.plan.places.spaces import find_spaces

DOORS_M = (0.6, 3.0)  # widths between which nobody asks; assumed: DIN 18040 has 0.8 m and more, closets less
MOST_WALLS = 50_000  # of a plan that is checked at an import: a few seconds
SAME_WALL_M = 0.65  # gaps with nearer middles are both faces of one wall; assumed
MARK_M = 0.1
MOST_ALIKE = 5  # on a level; more get one answer
DETAIL = re.compile(r"'[^']*'|\d+([.]\d+)?")
MOST_QUESTIONS = 60  # of a level: more take longer than two minutes


def with_questions(plan: Plan) -> Plan:
    """The plan whose levels carry their questions, the importer's first; each element is asked about once."""
    found: list[list[Question]] = [[*level.questions] for level in plan.levels]
    if sum(len(level.solid) for level in plan.levels) <= MOST_WALLS:
        for finding in check_plan(plan):
            found[finding.level] += _of_finding(finding, plan.levels[finding.level])
        for i, level in enumerate(plan.levels):
            found[i] += [*_of_widths(level), *_of_gaps(plan, i)]
    levels = zip(plan.levels, found, strict=True)
    return replace(plan, levels=tuple(replace(level, questions=_once(questions)) for level, questions in levels))


def _once(questions: list[Question]) -> tuple[Question, ...]:
    """The first question about each element; more than `MOST_ALIKE` that differ in names and numbers alone are one about all of their lines."""
    by_element = {(question.about, question.lines_m or question.at_m): question for question in reversed(questions)}
    by_text: dict[tuple[str, bool], list[Question]] = {}
    for question in reversed(by_element.values()):
        by_text.setdefault((DETAIL.sub("", question.text), question.is_proposed), []).append(question)
    groups = [
        _together(group) if len(group) > MOST_ALIKE and all(q.lines_m or q.about == "room" for q in group) else group
        for group in by_text.values()
    ]
    return tuple(question for group in groups for question in group)[:MOST_QUESTIONS]


def _together(group: list[Question]) -> list[Question]:
    """One question for all alike: the answer counts for each. A room's is a short line which begins at its place."""
    lines = (one.lines_m or [(*one.at_m, one.at_m[0] + MARK_M, one.at_m[1])] for one in group)
    return [replace(group[0], text=f"{len(group)} alike: {group[0].text}", lines_m=tuple(chain.from_iterable(lines)))]


def _of_finding(finding: PlanFinding, level: Level) -> Iterator[Question]:
    """The question for a finding of the check, if the editor can answer it: not about stairs, and not about walls that overlap."""
    at, lines = finding.position_m, finding.lines_m
    if finding.kind == "gap":
        wall = next(line for line in lines if at not in (line[:2], line[2:]))
        across = shapely.shortest_line(shapely.Point(at), shapely.LineString((wall[:2], wall[2:])))
        to = shapely.get_coordinates(across)[1]
        piece = (*at, round(float(to[0]), 4), round(float(to[1]), 4))
        yield Question(f"{finding.text}: close the gap?", "wall", at, (piece,), is_proposed=True)
    elif finding.kind == "door":
        yield Question(f"{finding.text}: is it right?", "door", at, lines)
    elif finding.kind in ("open room", "unreachable"):
        room = min(level.rooms, key=lambda one: math.dist(one.at_m, lines[0][:2] if lines else at))
        yield Question(f"{finding.text}: is it right?", "room", room.at_m)
    elif finding.kind == "no door":
        yield Question(f"{finding.text}: is it right?", "room", at)


def _of_widths(level: Level) -> Iterator[Question]:
    """Doors that are narrower or wider than usual."""
    for door in level.doors:
        if not DOORS_M[0] <= door.width_m <= DOORS_M[1]:
            text = f"door {door.width_m:.2f} m wide: is it a door?"
            yield Question(text, "door", door.middle_m, (door.line,))


def _of_gaps(plan: Plan, level_index: int) -> Iterator[Question]:
    """Rooms without a listed door: each gap that leads to one may be a door."""
    level, spaces = plan.levels[level_index], find_spaces(plan, level_index)
    if spaces is None:
        return
    listed = {face for _, a, b in spaces.doors[: len(level.doors)] for face in (a, b)}
    outlined = {spaces.face_at(*room.at_m): room for room in spaces.outlined}
    outlined.pop(OUTSIDE, None)  # a room that is open, as a balcony, is not the whole outside
    names = {face: room.name for face, room in outlined.items()} | {f: r[0].name for f, r in spaces.names.items()}
    asked: list[shapely.Point] = []
    for gap, a, b in spaces.doors[len(level.doors) :]:
        name = next((names[face] for face in (a, b) if face in names and face not in listed), None)
        across = shapely.LineString((gap.line[:2], gap.line[2:])).centroid
        if name is not None and all(across.distance(other) > SAME_WALL_M for other in asked):
            asked.append(across)
            x0, y0, x1, y1 = (round(value, 3) for value in gap.line)
            text = f"room {name!r} has no door, but a gap of {gap.width_m:.2f} m: is it a door?"
            yield Question(text, "door", ((x0 + x1) / 2, (y0 + y1) / 2), ((x0, y0, x1, y1),), is_proposed=True)
