# SPDX-License-Identifier: MIT
"""The study `doubt`: each kind of lie or unmeasured way in a tour of the office, through the whole tracker.

In: seeds. Out: the table, JSON, Parquet. Owns the kinds and the columns.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import groupby, pairwise

import numpy as np

from echostep.arrays import Floats
from echostep.localization import Estimate, TrackStatus
from echostep.plan import Plan, Pose
from echostep.ports.chunks import Chunk, portion_of
from echostep.tracker import Tracker
from echostep_app.output.table import Table
from echostep_simulation.devices.board import PythonBoard
from echostep_simulation.people.walker import Walk, Waypoint
from echostep_simulation.scenario import START_NS, Scenario
from echostep_studies.bench.judgement import FALSE_TRACKING_M
from echostep_studies.bench.sites import office
from echostep_studies.bench.walks import T, X, Y, Z
from echostep_studies.doubt import faults, wearers
from echostep_studies.doubt.wearers import Span
from echostep_studies.frame.parts import matching
from echostep_studies.frame.report import Row, by_name, means, named
from echostep_studies.frame.study import Study, StudyRequest
from echostep_studies.frame.truth import at_times

BEFORE_M, WITHIN_M = 25.0, 18.0  # way before the span, and in it
PAUSE_S = 4.0  # at its begin and end
STANDING_S = 60.0  # of the kinds that stand
PORTION_NS = 100_000_000  # the tracker gets what has arrived in this time at once
AGE_S = 2.0  # an older estimate is shown as one without measurements since
COLUMNS = {
    "name": "", "runs": "runs", "tracking": "says tracking %", "lost": "says lost %", "false": "false tracking %",
    "false_s": "longest s", "worst_m": "worst m", "end_m": "end m", "end_tracking": "ends tracking %",
}  # fmt: skip
NOTES = (
    "false tracking: share of the time with tracking and more than 1 m of error; longest: in a row, of all walks; worst: error while tracking.",
    f"An estimate older than {AGE_S:g} s has grown at a walker's speed since, as on the pages. Times are those after the span began.",
)


@dataclass(frozen=True, slots=True)
class Kind:
    """What happens, in a span of the walk: to the wearer, to what the rangers hear, to the bytes; `stands`: he stands all the while."""

    befalls: Callable[[Walk, Span], Walk] = lambda walk, _: walk
    hears: Callable[[faults.Rows, Floats, Span], None] = lambda _rows, _t_s, _span_s: None
    arrives: Callable[[Sequence[Chunk], Span], Sequence[Chunk]] = lambda chunks, _: chunks
    start: Callable[[Pose], Pose] = lambda pose: pose
    plan: Callable[[Plan], Plan] = lambda plan: plan
    stands: bool = False


KINDS = {
    "none": Kind(),
    "stands": Kind(stands=True),
    "passers-by": Kind(stands=True, hears=faults.passers_by),
    "fallen-off": Kind(wearers.fallen_off),
    "fallen-off/covered": Kind(wearers.fallen_off, faults.covered),
    "repeats": Kind(arrives=faults.repeating),
    "carried": Kind(wearers.carried),
    "carried/covered": Kind(wearers.carried, faults.covered),
    "trolley": Kind(wearers.on_trolley),
    "trolley/covered": Kind(wearers.on_trolley, faults.covered),
    "lift": Kind(wearers.lifted, stands=True),
    "rangers/die": Kind(hears=faults.one_after_the_other),
    "rangers/covered": Kind(hears=faults.covered),
    "plug": Kind(arrives=faults.loose_plug),
    "plug/both": Kind(arrives=faults.loose_plugs),
    "start/2m": Kind(start=lambda pose: replace(pose, x_m=pose.x_m + 2.0)),
    "start/90deg": Kind(start=lambda pose: replace(pose, heading_rad=pose.heading_rad + 0.5 * np.pi)),
    "plan/scaled": Kind(plan=lambda p: replace(p, levels=tuple(replace(at, walls=1.05 * at.walls) for at in p.levels))),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class DoubtRow:
    """One walk: shares of the time after the span began, the longest false claim (s), the greatest error while `tracking`, the last error (m)."""

    name: str
    seed: int
    tracking: float
    lost: float
    false: float
    false_s: float
    worst_m: float
    end_m: float
    end_tracking: bool


def doubt_run(names: Sequence[str], seed: int) -> list[DoubtRow]:
    """The rows of these kinds with the tour of this seed."""
    return [_row(name, KINDS[name], seed) for name in names]


def _row(name: str, kind: Kind, seed: int) -> DoubtRow:
    site = office(seed, 2.0 * BEFORE_M + 2.0 * WITHIN_M)
    way = _with_pauses(site.waypoints, STANDING_S if kind.stands else PAUSE_S)
    span_of = partial(_span, stands=kind.stands)
    scenario = Scenario(
        site.built, way, seed, PythonBoard(seed), befalls=lambda walk: kind.befalls(walk, span_of(walk))
    )
    span_s = span_of(scenario.walk)
    scenario.sensors = faults.Heard(scenario.sensors, kind.hears, span_s)  # type: ignore[assignment]  # has its rows
    tracker = Tracker(kind.plan(site.built), kind.start(scenario.start), seed=seed)
    shown = _tracked(tracker, kind.arrives(list(scenario.chunks()), span_s))
    return _judged(name, seed, shown, scenario.truth, 0.0 if name.startswith(("start", "plan")) else span_s[0])


def _with_pauses(waypoints: Sequence[Waypoint], pause_s: float) -> list[Waypoint]:
    """The waypoints with a pause at the first one after BEFORE_M, and at the first one WITHIN_M later."""
    at = np.array([w[:2] for w in waypoints])
    way_m = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(at, axis=0).T))])
    pauses = {int(np.argmax(way_m >= m)): s for m, s in ((BEFORE_M, pause_s), (BEFORE_M + WITHIN_M, PAUSE_S))}
    return [(*w[:2], pauses[k]) if k in pauses else w[:2] for k, w in enumerate(waypoints)]


def _span(walk: Walk, *, stands: bool) -> Span:
    """From the middle of the first pause on to the middle of the second, or all of the first."""
    goes = np.hypot(*np.gradient(walk.trunk_m, axis=0).T) > 1e-5
    edges = (np.flatnonzero(np.diff(goes.astype(int))) / 1000.0).tolist()
    first, second = [(a, b) for a, b in pairwise(edges) if b - a > 0.75 * PAUSE_S and not goes[int(500 * (a + b))]][:2]
    return first if stands else (0.5 * sum(first), 0.5 * sum(second))


def _tracked(tracker: Tracker, chunks: Sequence[Chunk]) -> list[tuple[float, Estimate]]:
    """What is shown after each tenth of a second, and when."""
    shown: list[tuple[float, Estimate]] = []
    for _, together in groupby(chunks, lambda chunk: chunk.t_arrival_ns // PORTION_NS):
        portion = list(together)
        at_s = 1e-9 * (portion[-1].t_arrival_ns - START_NS)
        newest = tracker.take(portion_of(portion))[-1:] or [estimate for _, estimate in shown[-1:]]
        shown += [(at_s, e if at_s - e.t_s < AGE_S else e.unobserved(at_s)) for e in newest]
    return shown


def _judged(name: str, seed: int, shown: Sequence[tuple[float, Estimate]], truth: Floats, from_s: float) -> DoubtRow:
    later = [(t, e) for t, e in shown if t >= from_s]
    true = at_times(np.array([e.t_s for _, e in later]), truth[:, T], truth[:, [X, Y, Z]])
    off_m = np.linalg.norm(np.array([(e.x_m, e.y_m, e.z_m) for _, e in later]) - true, axis=1)
    sure = np.array([e.status is TrackStatus.TRACKING for _, e in later])
    false, span_s = sure & (off_m > FALSE_TRACKING_M), np.diff([from_s, *(t for t, _ in later)])
    longest = since = 0.0
    for is_false, dt in zip(false.tolist(), span_s.tolist(), strict=True):
        since = since + dt if is_false else 0.0
        longest = max(longest, since)
    return DoubtRow(
        name=name, seed=seed, tracking=float(sure.mean()), lost=float(np.mean([e.status is TrackStatus.LOST for _, e in later])),
        false=float(false @ span_s / span_s.sum()), false_s=longest, worst_m=float(off_m[sure].max(initial=0.0)),
        end_m=float(off_m[-1]), end_tracking=bool(sure[-1]),
    )  # fmt: skip


def _summary(rows: Sequence[DoubtRow]) -> Row:
    shares = means(rows, ("tracking", "lost", "false", "end_tracking"), 5)
    worst = {key: max(getattr(row, key) for row in rows) for key in ("false_s", "worst_m")}
    return {**named(rows), **{k: 100.0 * v for k, v in shares.items()}, **worst, **means(rows, ("end_m",), 5)}


def doubt_study(pattern: str = "*") -> Study[DoubtRow, Row]:
    """The study of the kinds whose names match a pattern."""
    names = matching(KINDS, pattern)
    return Study("doubt", (DoubtRow,), partial(doubt_run, names), by_name(_summary), _tables)


def _tables(rows: list[Row], request: StudyRequest) -> list[Table]:
    title = f"What is claimed while a sensor lies or no step is measured: {request.runs} simulated walks a row"
    return [Table(title, rows, COLUMNS, NOTES)]
