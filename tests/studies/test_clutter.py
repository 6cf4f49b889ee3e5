# SPDX-License-Identifier: MIT
"""The study `clutter` on logs of a made building: what is read, drawn, heard and walked; hostile logs; the command."""

from __future__ import annotations

import gzip
import json
import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely

from command_line import echostep
from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep.localization import Start, TrackStatus
from echostep.path import MeasuredSegment
from echostep.plan import Plan
from echostep_studies.bench.filtering import Claim, FilterRun
from echostep_studies.bench.laser.building import building_of, hear, walk_from
from echostep_studies.bench.laser.carmen_log import CarmenLog, read_log
from echostep_studies.bench.laser.odometry import calibrated, odometry_of
from echostep_studies.bench.laser.wall_lines import straight_pieces, wall_segments
from echostep_studies.clutter import study
from echostep_studies.frame.report import as_dicts
from studies.carmen_logs import CUPBOARD, FAR_M, WALLS, poses, write_log


@pytest.fixture(scope="module")
def log_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("logs") / "made-corrected.log"
    write_log(path, np.vstack([WALLS, CUPBOARD]))
    return path


def lines_of(segments: Floats) -> shapely.MultiLineString:
    return shapely.MultiLineString([(s[:2], s[2:]) for s in segments.tolist()])


# ---- reading ----


def test_a_log_is_read_with_its_odometry(log_file: Path) -> None:
    log = read_log(log_file)
    assert log.name == "made"
    assert log.pose == pytest.approx(poses(), abs=1e-5)
    assert log.range_m.shape == (len(log.pose), 181)
    assert [len(o) for o in log.odometry] == [3] * len(log.pose)
    assert np.degrees(log.angles_rad[[0, 90, 180]]) == pytest.approx([-90.0, 0.0, 90.0])


def test_an_even_number_of_beams_lacks_the_leftmost() -> None:
    log = CarmenLog("a", np.zeros((1, 360)), np.zeros((1, 3)), (np.zeros((0, 3)),))
    assert np.degrees(log.angles_rad[[0, 180, 359]]) == pytest.approx([-90.0, 0.0, 89.5])


SCAN = b"FLASER 90 " + b"1.0 " * 90 + b"0 0 0 0 0 0 0 x 0\n"


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"", "0 laser scans"),
        (b"\x00\xff\xfe" * 50, "0 laser scans"),
        (SCAN * 19, "19 laser scans"),
        (SCAN * 3 + b"FLASER 90 1.0\n", "line 4: 93 numbers"),
        (SCAN.replace(b"1.0", b"nan", 1) * 30, "line 1: 93 numbers"),
        (SCAN.replace(b"1.0", b"1e300", 1) * 30, "line 1: 93 numbers"),
        (SCAN.replace(b"1.0", b"zwei", 1) * 30, "line 1: 93 numbers"),
        (b"FLASER 1000000000000 1.0\n", "line 1: FLASER needs a number of beams"),
        (b"FLASER -3 1.0\n", "line 1: FLASER needs a number of beams"),
        (b"FLASER\n", "line 1: FLASER needs a number of beams"),
        (SCAN + b"ODOM 1 2\n", "line 2: 3 numbers"),
        (SCAN + SCAN.replace(b"90", b"91", 1).replace(b"1.0", b"1.0 1.0", 1), "line 2: a scan of 91 beams"),
        (SCAN + b"x" * 200_000, "line 2: longer than"),
    ],
)
def test_hostile_logs_are_answered_by_one_error(content: bytes, says: str, tmp_path: Path) -> None:
    path = tmp_path / "hostile.log"
    path.write_bytes(content)
    with pytest.raises(EchostepError, match=says) as error:
        read_log(path)
    assert str(path) in str(error.value)


def test_damaged_archives_are_answered_with_the_line(tmp_path: Path) -> None:
    path = tmp_path / "cut.log.gz"
    whole = gzip.compress(SCAN * 30)
    for content in (whole[:-20], b"not an archive", whole[:40] + b"\x00" * 40):
        path.write_bytes(content)
        with pytest.raises(EchostepError, match=r"cut\.log\.gz: cannot be read after line"):
            read_log(path)


# ---- the plans ----


def test_the_plans_are_those_of_the_building(log_file: Path) -> None:
    plans = building_of(log_file, 1).plans
    full, walls = (plans[name].levels[0].walls for name in ("full", "walls"))
    built = lines_of(np.vstack([WALLS, CUPBOARD]))
    assert max(built.distance(shapely.Point(p)) for p in full.reshape(-1, 2)) < 0.1
    assert lines_of(full).buffer(0.1).intersection(built).length > 0.85 * built.length
    assert lines_of(CUPBOARD).buffer(0.1).intersection(lines_of(walls)).length < 0.3
    assert straight_pieces(walls, 1.5) == pytest.approx(walls)
    assert lines_of(walls).buffer(0.1).intersection(lines_of(WALLS)).length > 0.8 * lines_of(WALLS).length


def test_the_way_crosses_no_wall_of_the_plan(log_file: Path) -> None:
    full = building_of(log_file, 1).plans["full"].levels[0].walls
    assert not shapely.LineString(poses()[:, :2]).intersects(lines_of(full))


def test_a_passer_by_is_not_drawn(tmp_path: Path) -> None:
    """Someone stands in the room in one scan of many."""
    path = tmp_path / "passer.log"
    write_log(path, WALLS)
    text = path.read_text().splitlines()
    scan = next(k for k, line in enumerate(text) if line.startswith("FLASER"))
    words = text[scan].split()
    words[2 + 80 : 2 + 100] = ["0.8"] * 20
    text[scan] = " ".join(words)
    path.write_text("\n".join(text))
    full = building_of(path, 1).plans["full"].levels[0].walls
    assert max(lines_of(WALLS).distance(shapely.Point(p)) for p in full.reshape(-1, 2)) < 0.1


def test_straight_pieces_meet_at_corners() -> None:
    along = np.arange(0.05, 2.0, 0.1)
    corner = np.vstack([np.column_stack([along, np.zeros(20)]), np.column_stack([np.zeros(20), along])])
    segments = straight_pieces(wall_segments(corner), 1.0)
    assert len(segments) == 2
    assert len(np.unique(np.round(segments.reshape(-1, 2), 6), axis=0)) == 3  # one end is that of both
    assert np.hypot(*segments.reshape(-1, 2).T).min() < 0.02


# ---- pings ----


def scan_log(range_m: Floats) -> CarmenLog:
    return CarmenLog("a", range_m, np.zeros((len(range_m), 3)), (np.zeros((0, 3)),) * len(range_m))


def test_each_ranger_hears_the_nearest_return_on_its_side() -> None:
    far = np.full((400, 181), FAR_M)
    far[:, 175], far[:, 170], far[:, 10] = 2.0, 3.0, 1.5  # 85 and 80 degrees left, 80 degrees right
    far[:, 90] = 0.5  # ahead
    heard = hear(scan_log(far), np.arange(400), np.random.default_rng(3))
    assert np.nanmedian(heard, axis=0) == pytest.approx([2.0, 1.5], abs=0.08)
    assert np.nanstd(heard[:, 0]) == pytest.approx(0.025, abs=0.005)


def test_what_is_too_far_or_too_faint_is_not_heard() -> None:
    far = np.full((200, 181), FAR_M)
    far[:, 180], far[:, 0] = 6.5, 6.0  # beyond the ranger; on the axis at the very limit
    heard = hear(scan_log(far), np.arange(200), np.random.default_rng(3))
    assert np.isnan(heard[:, 0]).all()
    assert 0.3 < np.isnan(heard[:, 1]).mean() < 0.7
    rim = np.full((200, 181), FAR_M)
    rim[:, 180 - 27] = 5.0  # faint at the rim of the cone
    assert np.isnan(hear(scan_log(rim), np.arange(200), np.random.default_rng(3))[:, 0]).mean() > 0.9


# ---- the path ----


def test_exact_odometry_leads_along_the_poses(log_file: Path) -> None:
    walk = walk_from(building_of(log_file, 1), 0)
    dx, dy = np.sum([(s.segment.dx_m, s.segment.dy_m) for s in walk.segments], axis=0)
    c, s = math.cos(walk.true[0, 2]), math.sin(walk.true[0, 2])
    assert (c * dx - s * dy, s * dx + c * dy) == pytest.approx(tuple(walk.true[-1, :2] - walk.true[0, :2]), abs=0.02)
    assert len(walk.at_scan) == len(walk.true)
    pinged = [k for k, i in enumerate(walk.at_scan) if len(walk.segments[i].t_s)]
    assert pinged == list(range(1, len(walk.true), 2))  # the odd scans


def test_a_walk_of_some_metres_begins_anywhere(log_file: Path) -> None:
    walk = walk_from(building_of(log_file, 1), 40, 5.0)
    assert walk.walked_m[0] == 0.0
    assert 5.0 <= walk.walked_m[-1] < 5.3
    assert (walk.start.x_m, walk.start.y_m) == pytest.approx(tuple(poses()[40, :2]), abs=1e-4)


@pytest.mark.parametrize(
    ("drifting", "late", "source", "turn_deg"),
    [(True, False, "raw odometry", 1.0), (False, True, "corrected increments, 3 % and 2 degrees of noise", 2.0)],
)
def test_odometry_states_its_own_errors(
    drifting: bool, late: bool, source: str, turn_deg: float, tmp_path: Path
) -> None:
    write_log(tmp_path / "a.log", WALLS, drifting=drifting, late=late)
    odometry = odometry_of(read_log(tmp_path / "a.log"), np.random.default_rng(1))
    assert odometry.source == source
    assert math.degrees(odometry.turn_sd_rad) == pytest.approx(turn_deg, abs=0.05)


def test_calibrated_odometry_has_no_turn_on_each_metre(tmp_path: Path) -> None:
    write_log(tmp_path / "a.log", WALLS)
    log = read_log(tmp_path / "a.log")
    true = odometry_of(log, np.random.default_rng(1))
    biased = replace(true, steps=tuple(s + np.outer(np.hypot(s[:, 0], s[:, 1]), [0.0, 0.0, 0.05]) for s in true.steps))
    turns, exact = (
        np.concatenate([step[:, 2] for step in steps]) for steps in (calibrated(biased, log).steps, true.steps)
    )
    assert turns == pytest.approx(exact, abs=1e-3)


# ---- the command ----


@pytest.mark.long
def test_the_command_tracks_every_log_of_a_folder(log_file: Path, tmp_path: Path) -> None:
    echostep(
        "evaluate", "clutter", "--data", str(log_file.parent), "--starts", "0", "--json", "c.json", cwd=tmp_path, ends=0
    )
    rows = {row["name"]: row for row in json.loads((tmp_path / "c.json").read_text())["rows"]}
    assert set(rows) == {"made/full/tracked", "made/walls/tracked"}
    assert rows["made/full/tracked"]["lost"] == 0
    assert rows["made/full/tracked"]["source"] == "raw odometry"
    assert (tmp_path / "out" / "clutter" / "made.png").stat().st_size > 10_000


def test_unknown_starts_lie_where_the_log_goes_on(log_file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def at_the_origin(segments: Sequence[MeasuredSegment], _plan: Plan, start: Start, _seed: int) -> FilterRun:
        assert start.pose is None
        assert start.room_m is None
        claims = [Claim(s.segment.t1_s, 0.0, 0.0, 0, 0.0, TrackStatus.LOST, math.inf) for s in segments]
        return FilterRun(tuple(claims), 1, 1.0)

    monkeypatch.setattr(study, "UNKNOWN_M", 2.0)
    monkeypatch.setattr(study, "track", at_the_origin)
    rows = study.clutter_run((log_file,), 2, 10, 12)  # the second unknown start of the first log
    assert [row.name for row in rows] == ["made/full/unknown", "made/walls/unknown"]
    assert as_dicts(rows) == json.loads(json.dumps(as_dicts(rows)))
    assert 8 <= len(rows[0].error_m) <= 14  # scans of 0.25 m
    starts = {study._unknown_scan(building_of(log_file, 1), number) for number in range(200)}
    assert len(starts) > 50
    last = walk_from(building_of(log_file, 1), max(starts), 2.0)
    assert last.walked_m[-1] >= 2.0
