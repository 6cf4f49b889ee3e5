# SPDX-License-Identifier: MIT
"""The study `anywhere`: its columns by hand, its conditions on a made walk, and a small run of the command."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest
import shapely

from command_line import echostep
from echostep.arrays import Floats
from echostep.localization import Start, TrackStatus
from echostep.path import MeasuredSegment, PathSegment
from echostep.plan import Connector, ConnectorKind, Level, Plan, Pose
from echostep_studies.anywhere import amcl, kidnaps, plan_changes
from echostep_studies.anywhere.study import PEER, anywhere_study
from echostep_studies.bench import echo_changes, sites, walks
from echostep_studies.bench.columns import JudgedRow, run_row, summaries
from echostep_studies.bench.filtering import Claim, FilterRun
from echostep_studies.bench.judgement import JudgedRun, TruePlaces, judge, true_levels
from echostep_studies.bench.walks import SimulatedWalk
from echostep_studies.frame.report import as_dict

TRACKING, UNCERTAIN, LOST = TrackStatus.TRACKING, TrackStatus.UNCERTAIN, TrackStatus.LOST
CODE = {TRACKING: 0.0, UNCERTAIN: 1.0, LOST: 2.0}
ROOM = np.array([(0.0, 0.0, 10.0, 0.0), (10.0, 0.0, 10.0, 4.0), (10.0, 4.0, 0.0, 4.0), (0.0, 4.0, 0.0, 0.0)])


def run_of(
    error_m: list[float], status: list[TrackStatus], protection_m: float = 2.0, pace_m: float = 10.0
) -> JudgedRun:
    """Claims a second and `pace_m` apart."""
    k = np.arange(len(error_m), dtype=float)
    codes = np.array([CODE[s] for s in status])
    return JudgedRun(k, pace_m * k, np.array(error_m), codes, np.full(len(k), protection_m), np.zeros(0, np.bool_))


# ---- columns ----


def test_found_is_for_good_and_within_forty_metres() -> None:
    assert run_of([0.2, 0.3], [TRACKING] * 2).found_m == 0.0
    assert run_of([5.0, 2.0, 0.9, 0.1], [LOST] * 4).found_m == 20.0
    assert run_of([0.1, 0.1, 0.1, 1.1], [TRACKING] * 4).found_m is None  # off at the end
    late = run_of([5.0] * 5 + [0.1], [LOST] * 6)
    assert late.found_m is None  # after 50 m
    assert run_of([5.0] * 4 + [0.1], [LOST] * 5).found_m == 40.0


def test_false_claims_are_strictly_beyond_their_limits() -> None:
    run = run_of([1.0, 1.01, 0.5, 0.49, 1.5], [TRACKING, TRACKING, LOST, LOST, UNCERTAIN])
    assert run.false_tracking.tolist() == [False, True, False, False, False]
    assert run.false_lost.tolist() == [False, False, False, True, False]
    assert run_of([1.9, 2.0, 2.1], [TRACKING] * 3).beyond_protection.tolist() == [False, False, True]


@pytest.mark.parametrize(
    ("error_m", "status", "delays_s"),
    [
        ([0.1, 4.0, 4.0, 4.0, 0.1], [TRACKING, TRACKING, TRACKING, LOST, TRACKING], [2.0]),
        ([4.0, 4.0], [UNCERTAIN, TRACKING], [0.0]),
        ([0.1, 4.0, 4.0, 0.1], [TRACKING] * 4, [2.0]),  # never flagged, until it was over
        ([0.1, 4.0, 4.0, 4.0], [TRACKING] * 4, [2.0]),  # never flagged, until the end
        ([4.0, 0.1, 4.0, 4.0], [LOST, LOST, TRACKING, LOST], [0.0, 1.0]),
        ([3.0, 2.9], [TRACKING] * 2, []),
    ],
)
def test_delay_of_the_alarm(error_m: list[float], status: list[TrackStatus], delays_s: list[float]) -> None:
    assert run_of(error_m, status).alarm_delays_s == delays_s


def test_false_alarms_begin_while_tracking() -> None:
    assert run_of([0.1] * 5, [LOST, LOST, TRACKING, LOST, LOST]).false_alarms == 1
    assert run_of([0.1] * 5, [TRACKING, UNCERTAIN, LOST, TRACKING, LOST]).false_alarms == 2
    assert run_of([4.0] * 3, [TRACKING, LOST, LOST]).false_alarms == 0


def claim(t_s: float, x_m: float, status: TrackStatus = TRACKING, plan_fits: float = 1.0) -> Claim:
    return Claim(t_s, x_m, 0.0, 0, 0.0, status, math.inf, plan_fits, covariance_m2=(0.04, 0.0, 0.01))


def test_a_wrong_floor_is_a_storey_off() -> None:
    claims = [claim(0.0, 0.0), claim(1.0, 0.0), claim(2.0, 6.0)]
    right = np.array([[True, False], [False, True], [False, True]])
    run = judge(claims, TruePlaces(np.zeros((3, 2)), right), np.zeros(3))
    assert run.error_m.tolist() == [0.0, 3.5, 6.0]


def test_an_ellipse_holds_what_is_within_it_on_the_right_floor() -> None:
    """0.2 m along x and 0.1 m along y: 95 % within 2.45 times that."""
    claims = [claim(0.0, 0.48), claim(1.0, 0.50), claim(2.0, 0.0), claim(3.0, 0.0), claim(4.0, 0.0, UNCERTAIN)]
    true_m = np.array([[0.0, 0.0], [0.0, 0.0], [0.0, 0.24], [0.0, 0.0], [0.0, 0.0]])
    right = np.array([[True], [True], [True], [False], [True]])
    assert judge(claims, TruePlaces(true_m, right), np.zeros(5)).in_ellipse.tolist() == [True, False, True, False]
    # Further off than a storey is high
    wide = Claim(0.0, 5.0, 0.0, 0, 0.0, TRACKING, math.inf, covariance_m2=(9.0, 0.0, 9.0))
    assert [
        judge([wide], TruePlaces(np.zeros((1, 2)), floor), np.zeros(1)).in_ellipse.tolist()
        for floor in (right[:1], right[3:4])
    ] == [[True], [False]]
    unstated = Claim(0.0, 0.0, 0.0, 0, 0.0, TRACKING, math.inf)
    assert judge([unstated], TruePlaces(true_m[:1], right[:1]), np.zeros(1)).in_ellipse.tolist() == []


SQUARE_M = np.array([[0, 0], [2, 0], [2, 2], [0, 2]], float)


@pytest.mark.parametrize(
    ("x_m", "kind", "height_m", "right"),
    [
        (1.0, "lift", 2.5, [True, True, False, False]),  # it passes floor 1 on its way from 0 to 2
        (1.0, "lift", 4.0, [True, True, True, False]),  # and is about halfway
        (1.0, "lift", 7.0, [False, False, True, False]),
        (5.0, "lift", 4.0, [False, True, False, False]),  # beside the lift
        (1.0, "stairs", 4.0, [False, True, False, False]),
        (5.0, "lift", 1.9, [True, True, False, False]),  # a tie
    ],
)
def test_in_a_lift_the_nearest_stop_is_right_too(
    x_m: float, kind: ConnectorKind, height_m: float, right: list[bool]
) -> None:
    levels = tuple(Level(str(k), 3.5 * k, ROOM) for k in range(4))
    plan = Plan("tower", levels, None, "", (Connector(kind, "shaft", (0, 2), SQUARE_M),))
    assert true_levels(np.array([[x_m, 1.0]]), np.array([height_m]), plan).tolist() == [right]


def test_a_summary_by_hand() -> None:
    """Two runs of two claims: one found, one 4 m off that says tracking."""
    good = FilterRun((claim(0.0, 0.1), claim(3600.0, 0.3)), 100, 36.0)
    bad = FilterRun((claim(0.0, 4.0), claim(3600.0, 4.0, plan_fits=0.2)), 300, 36.0)
    walked = np.array([0.0, 50.0])
    truth = TruePlaces(np.zeros((2, 2)), np.ones((2, 1), np.bool_))
    judged = [judge(run.claims, truth, walked) for run in (good, bad)]
    rows = [run_row("a", seed, j, run) for seed, (j, run) in enumerate(zip(judged, (good, bad), strict=True))]
    assert [msgspec.convert(json.loads(json.dumps(as_dict(row))), JudgedRow) for row in rows] == rows
    (row,) = summaries(rows)
    expected = {
        "runs": 2, "found": 0.5, "listed": 0.5, "found_m": 0.0, "mean_m": 0.2, "median_m": 2.15, "lost": 1, "false_tracking": 0.5, "false_lost": 0.0,
        "beyond_protection": 0.0, "alarm_s": 3600.0, "alarm_in_5s": 0.0, "false_alarms_h": 0.0, "named": 0.5, "tracking": 1.0, "in_ellipse": 0.5,
        "most_particles": 300, "times_real_time": 100.0,
    }  # fmt: skip
    assert {key: value for key, value in row.items() if key in expected} == expected
    assert row["ce95_m"] == pytest.approx(0.29)


def test_a_run_without_a_place_on_the_plan_has_a_verdict_only() -> None:
    (row,) = summaries([run_row("a", 1, None, FilterRun((claim(0.0, 0.0), claim(1.0, 0.0, LOST, 0.1)), 1, 1.0))])
    assert (row["named"], row["tracking"], "found" in row) == (1.0, 0.5, False)


def test_a_hypothesis_on_the_right_floor_lists_the_place() -> None:
    truth = TruePlaces(np.zeros((1, 2)), np.array([[True, False]]))

    def is_listed(x_m: float, level: int) -> bool:
        return judge([replace(claim(0.0, 9.0), places=((9.0, 0.0, 0), (x_m, 0.0, level)))], truth, np.zeros(1)).listed

    assert is_listed(2.0, 0)
    assert not is_listed(2.0, 1)
    assert not is_listed(3.0, 0)


# ---- conditions ----


def straight_walk() -> SimulatedWalk:
    """60 steps of a metre and a second along a corridor, two pings a step, both 1 m; a lift from 20 to 26 s."""
    segments = []
    for k in range(60):
        path = PathSegment(float(k), k + 1.0, 1.0, 0.0, 0.0, 0.0, 0.01, 0.01, k)
        pings = np.array([k + 0.3, k + 0.6]), np.array([0, 1]), np.ones(2)
        segments.append(MeasuredSegment(path, *pings, np.full(2, 7.0 if k > 23 else 0.0)))
    t_s = np.arange(0.0, 60.5, 0.5)
    z = np.interp(t_s, [20.0, 26.0], [0.0, 7.0])
    truth = np.column_stack([t_s, t_s, np.zeros((len(t_s), 2)), z])
    return SimulatedWalk(sites.plan_of("corridor", ROOM), tuple(segments), truth)


def ranges(walk: SimulatedWalk) -> Floats:
    return np.concatenate([s.range_m for s in walk.segments])


def test_people_answer_before_walls_only() -> None:
    rng = np.random.default_rng(1)
    walk = straight_walk()
    far = replace(walk, segments=tuple(replace(s, range_m=np.full(2, np.nan)) for s in walk.segments))
    heard = ranges(echo_changes.with_people(far, 0.5, rng))
    assert 0.3 < np.mean(np.isfinite(heard)) < 0.7
    assert np.nanmin(heard) >= 0.3
    assert ranges(echo_changes.with_people(walk, 0.5, rng)).max() == 1.0


def test_silence_and_one_ranger() -> None:
    walk = straight_walk()
    assert np.isnan(ranges(echo_changes.silenced(walk, 0.5, np.random.default_rng(1)))).mean() == pytest.approx(
        0.5, abs=0.1
    )
    assert {int(r) for s in echo_changes.one_ranger(walk).segments for r in s.ranger} == {0}


def test_panes_stand_beside_the_way() -> None:
    site = sites.office(1)
    glazed = echo_changes.with_panes(site, np.random.default_rng(1))
    panes = glazed.built.levels[0].walls[len(site.built.levels[0].walls) :]
    way = shapely.LineString([w[:2] for w in site.waypoints])
    assert len(panes) == 8
    assert min(way.distance(shapely.LineString(p.reshape(2, 2))) for p in panes) > 0.5


def test_carried_twenty_metres_the_foot_says_it_stood() -> None:
    walk, from_s = kidnaps.carried(straight_walk(), 30.0, 20.0)
    assert from_s == 50.0
    way = sum(s.segment.dx_m for s in walk.segments)
    assert way == 40.0
    (stood,) = [s for s in walk.segments if s.segment.t1_s - s.segment.t0_s > 1.5]
    assert (stood.segment.t0_s, stood.segment.t1_s, len(stood.t_s)) == (30.0, 50.0, 0)


def test_off_in_a_lift_pressure_begins_anew() -> None:
    walk, from_s = kidnaps.off_in_lift(straight_walk())
    assert from_s == 29.0
    assert not any(17.0 < s.segment.t1_s <= 29.0 for s in walk.segments)
    assert {float(h) for s in walk.segments for h in s.height_m} == {0.0}


def test_a_restart_has_no_past() -> None:
    walk, from_s = kidnaps.restarted(straight_walk(), 35.0)
    assert from_s == walk.segments[0].segment.t0_s == 35.0


def test_the_room_of_a_place_is_bounded_by_its_walls() -> None:
    walls = shapely.MultiLineString(list(box(sites.one_floor(1, 0).built).reshape(-1, 2, 2)))
    for x, y in ((3.0, 5.0), (20.0, -1.0), (29.0, 5.0), (15.0, 1.5)):
        room = shapely.Polygon(sites.room_at(x, y))
        assert room.contains(shapely.Point(x, y))
        assert room.exterior.intersection(walls.buffer(1e-6)).length > 0.6 * room.length  # the rest is doors
        assert room.buffer(-0.25).intersection(walls).length == 0.0


def box(plan: Plan) -> Floats:
    return plan.levels[0].walls


def test_changed_plans() -> None:
    plan, rng = sites.plan_of("room", ROOM), np.random.default_rng(1)
    moved = plan_changes.displaced(plan, 0.1, rng)
    off = box(moved) - ROOM
    assert moved.uncertainty_m == 0.1
    assert np.abs(off).max() < 0.4
    assert (off[:, :2] == off[:, 2:]).all()  # moved, not turned
    assert off[0, 0] == 0.0  # along its normal
    way = np.column_stack([np.linspace(1.0, 9.0, 50), np.full(50, 1.0)])
    assert len(box(plan_changes.wall_missing(plan, way, rng))) == 3
    added = box(plan_changes.wall_added(plan, way, rng))[-1]
    assert shapely.LineString(added.reshape(2, 2)).crosses(shapely.LineString(way))
    mirrored, pose = plan_changes.mirrored(plan, Pose(2.0, 1.0, 0.0))
    assert (pose.x_m, pose.heading_rad) == (8.0, math.pi)
    assert sorted(map(tuple, np.abs(box(mirrored)).tolist()))[0] == (0.0, 0.0, 0.0, 4.0)
    beside = box(plan_changes.beside_half_turn(plan, way, rng))
    turned = 2.0 * np.array([10.0 + plan_changes.APART_M, 2.0]) - beside[4:].reshape(-1, 2, 2)
    assert len(turned) == 3
    assert all(any(np.allclose(wall, at) for at in ROOM.reshape(-1, 2, 2)) for wall in turned)


@pytest.mark.parametrize(
    "site", [sites.office(2), sites.three_floors(2), sites.by_lift(2), sites.hall(2), sites.yard(2)]
)
def test_walks_are_long_and_keep_clear_of_walls(site: sites.Site) -> None:
    xy = np.array([w[:2] for w in site.waypoints])
    assert np.hypot(*np.diff(xy, axis=0).T).sum() > 60.0
    z = np.array([w[3] if len(w) > 3 else 0.0 for w in site.waypoints])
    heights = np.array([level.height_m for level in site.built.levels])
    for k in range(len(xy) - 1):
        for level in {int(np.abs(heights - at).argmin()) for at in z[k : k + 2]}:
            walls = shapely.MultiLineString(list(site.built.levels[level].walls.reshape(-1, 2, 2)))
            assert walls.distance(shapely.LineString(xy[k : k + 2])) > 0.2


# ---- the peer ----


@pytest.mark.long
def test_augmented_mcl_tracks_and_adds_random_poses_when_the_likelihood_falls(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(amcl, "SIZE", 2000)
    site = sites.hall(1)
    walk = walks.simulate(replace(site, waypoints=site.waypoints[:2]), 1)
    run = amcl.track_by_amcl(walk.segments, site.built, Start(walk.pose_at(0.0)), 1)
    last = run.claims[-1]
    true = walk.pose_at(last.t_s)
    assert math.hypot(last.x_m - true.x_m, last.y_m - true.y_m) < 1.0
    peer = amcl.AugmentedMcl(site.built, Start(walk.pose_at(0.0)), 0.0, np.random.default_rng(1))
    for slow, fast, share in ((1.0, 1.2, 0.0), (1.0, 0.75, 0.25)):
        peer._slow, peer._fast = slow, fast
        peer._resample(0.0)
        far = np.abs(peer._particles.x_m - walk.pose_at(0.0).x_m) > 2.0
        assert far.mean() == pytest.approx(share, abs=0.05)


# ---- the command ----


@pytest.mark.long
def test_the_command_writes_its_table_and_the_diagrams(tmp_path: Path) -> None:
    found = echostep(
        "evaluate", "anywhere", "--runs", "1", "--rows", "hall", "--json", "a.json", "--out", "out", cwd=tmp_path
    )
    assert found.returncode == 0, found.stderr
    (row,) = json.loads((tmp_path / "a.json").read_text())["rows"]
    assert (row["name"], row["runs"], row["found"]) == ("hall", 1, 1.0)
    assert row["mean_m"] < 0.3
    assert (tmp_path / "out" / "stanford.png").stat().st_size > 10_000


@pytest.mark.parametrize(("rows", "peers"), [("*", 0), ("kidnap/*", 0), ("*/amcl", 8), ("kidnap/lift/amcl", 1)])
def test_the_peer_is_run_where_it_is_named(rows: str, peers: int) -> None:
    names = anywhere_study(None, rows).run.args[0]  # type: ignore[attr-defined]
    assert sum(name.endswith(PEER) for name in names) == peers
    assert peers in (0, len(names))
