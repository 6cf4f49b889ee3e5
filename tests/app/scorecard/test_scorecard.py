# SPDX-License-Identifier: MIT
"""Every metric against a case computed by hand, and against evo's absolute trajectory error."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from echostep.errors import EchostepError
from echostep.ports.chunks import portion_of
from echostep.tracker import Tracker
from echostep.walk.table import write_track
from echostep_app.scorecard import csv_columns
from echostep_app.scorecard.card import GAP_S, NO_ZONE, Scorecard, Zones, score
from echostep_app.scorecard.csv_columns import read_csv
from echostep_app.scorecard.definitions import METRICS
from echostep_app.scorecard.track_columns import load_path
from echostep_app.scorecard.truth import card_of, load_truth
from echostep_simulation.devices.board import PythonBoard
from echostep_simulation.scenario import demo_scenario
from echostep_simulation.world.tower import LENGTH_M, LIFT_AT, STOREY_M, tower
from walks import PLAN, walk_chunks


def written(path: Path, text: str) -> Path:
    path.write_text(text)
    return path


def scored(folder: Path, track: str, truth: str) -> Scorecard:
    """The card of a track, as text of both files; without a plan."""
    track_path, truth_path = written(folder / "track.csv", track), written(folder / "truth.csv", truth)
    return score(load_path(track_path, None), load_path(truth_path, None))


# A wearer stands at the origin for 4 s; the errors are (3, 4), (0, 0), (-1, 0), (0, 2): 5, 0, 1 and 2 m.
STANDING = "t,x,y,z,floor\n" + "".join(f"{0.1 * k:.1f},0,0,0,1\n" for k in range(41))
FOUR = "t_s,x,y,z,floor,radius95_m,latency_s\n1,3,4,12,1,4,0.1\n2,0,0,0,1,1,0.2\n3,-1,0,0,1,1,0.3\n4,0,2,-1.5,2,,0.4\n"


def test_four_errors_by_hand(tmp_path: Path) -> None:
    card = scored(tmp_path, FOUR, STANDING)
    assert (card.points, card.span_s) == (4, 3.0)
    assert card.horizontal.mean_m == pytest.approx(2.0)
    assert card.horizontal.sd_m == pytest.approx(math.sqrt((9 + 4 + 1 + 0) / 4))
    assert card.horizontal.rms_m == pytest.approx(math.sqrt((25 + 0 + 1 + 4) / 4))
    assert (card.horizontal.min_m, card.horizontal.max_m, card.horizontal.ending_m) == pytest.approx((0.0, 5.0, 2.0))
    assert card.bias_m == pytest.approx(math.hypot(2 / 4, 6 / 4))
    xx, xy, yy = card.covariance_m2
    assert (xx, xy, yy) == pytest.approx((10 / 4 - 0.25, 12 / 4 - 0.75, 20 / 4 - 2.25))


def test_percentiles_by_hand(tmp_path: Path) -> None:
    """Of 0, 1, 2, 5: the median is half way between 1 and 2; 95 % lies at 2.85 of 3 intervals: 2 + 0.85 x 3."""
    card = scored(tmp_path, FOUR, STANDING)
    assert (card.ce50_m, card.ce95_m) == pytest.approx((1.5, 4.55))
    assert (card.horizontal.p75_m, card.horizontal.p90_m) == pytest.approx((2.0 + 0.25 * 3.0, 2.0 + 0.7 * 3.0))


def test_heights_by_hand(tmp_path: Path) -> None:
    """Heights 12, 0, 0, 1.5 m off; in space 13, 0, 1 and 2.5 m."""
    card = scored(tmp_path, FOUR, STANDING)
    assert card.vertical is not None
    assert card.spherical is not None
    assert card.vertical.mean_m == pytest.approx(13.5 / 4)
    assert card.ve95_m == pytest.approx(1.5 + 0.85 * 10.5)
    assert card.spherical.mean_m == pytest.approx(16.5 / 4)
    assert card.se95_m == pytest.approx(2.5 + 0.85 * 10.5)


def test_floors_and_the_evaal_score_by_hand(tmp_path: Path) -> None:
    """Three of four floors are right; 2 m on the wrong floor are 17 m: of 0, 1, 5, 17 the third quartile is 5 + 0.25 x 12."""
    card = scored(tmp_path, FOUR, STANDING)
    assert card.floor_probability == pytest.approx(0.75)
    assert card.evaal_knows_floors
    assert card.evaal_m == pytest.approx(8.0)


def test_two_floors_off_cost_thirty_metres(tmp_path: Path) -> None:
    card = scored(tmp_path, "t,x,y,floor\n1,0,1,3\n2,0,1,3\n", STANDING)
    assert (card.floor_probability, card.evaal_m) == pytest.approx((0.0, 31.0))


def test_without_floors_the_score_is_horizontal_and_says_so(tmp_path: Path) -> None:
    card = scored(tmp_path, "t,x,y\n1,3,4\n2,0,0\n", STANDING)
    assert (card.floor_probability, card.zone_probability, card.evaal_knows_floors) == (None, None, False)
    assert card.evaal_m == pytest.approx(3.75)
    assert (card.vertical, card.ve95_m, card.se95_m, card.latency_mean_s) == (None, None, None, None)


def test_stated_radii_and_latency_by_hand(tmp_path: Path) -> None:
    """5 > 4 m, 0 <= 1, 1 <= 1, and one row states no radius; latencies 0.1 to 0.4 s."""
    card = scored(tmp_path, FOUR, STANDING)
    assert card.radius95_holds == pytest.approx(2 / 3)
    assert (card.latency_mean_s, card.latency_p95_s) == pytest.approx((0.25, 0.385))


def test_an_ellipse_holds_what_its_distance_says(tmp_path: Path) -> None:
    """Along x 1 m2, along y 0.01 m2: 2.4 m off in x is within 95 %, 2.5 m is not; 0.3 m off in y is not."""
    track = "t,x,y,xx_m2,xy_m2,yy_m2\n1,2.4,0,1,0,0.01\n2,2.5,0,1,0,0.01\n3,0,0.3,1,0,0.01\n4,0,0,0,0,0\n"
    card = scored(tmp_path, track, STANDING)
    assert card.ellipse95_holds == pytest.approx(0.5)
    assert card.radius95_holds == pytest.approx(0.75)  # of 2.45 m in every direction, and 0 m at the true place


def test_time_and_places_without_a_position(tmp_path: Path) -> None:
    """10 s at 1 m/s, rows at 0 and 1 s, one that is lost at 2 s, and at 8 s: known are 0 to 2 s without its end, and 8 to 10 s."""
    truth = "t,x,y\n" + "".join(f"{0.1 * k:.1f},{0.1 * k:.1f},0.5\n" for k in range(101))
    track = "t,x,y,status\n0,0,0.5,tracking\n1,1,0.5,tracking\n2,9,9,lost\n8,8,0.5,uncertain\n"
    card = scored(tmp_path, track, truth)
    assert card.availability == pytest.approx((20 + 21) / 101)
    assert card.coverage == pytest.approx(5 / 11)  # the square metres from 0, 1, 8, 9 and 10 m on, of 11
    assert card.horizontal.max_m == pytest.approx(0.0)


def test_surveyed_points_are_compared_where_they_are(tmp_path: Path) -> None:
    """Points at 0, 10 and 20 s; the track goes 0 to 10 m within 10 s, then is silent: two points, one of them 1 m off."""
    truth = "t,x,y\n0,0,0\n10,10,1\n20,20,0\n"
    track = "t,x,y\n" + "".join(f"{2 * k},{2 * k},0\n" for k in range(6)) + "30,30,0\n"
    card = scored(tmp_path, track, truth)
    assert card.points == 2
    assert card.horizontal.mean_m == pytest.approx(0.5)
    assert (card.coverage, card.availability) == pytest.approx((2 / 3, 2 / 3))
    assert GAP_S > 2.0


def test_a_plan_tells_floors_by_height_and_zones(tmp_path: Path) -> None:
    """Up the tower: on the corridor, in a room instead, in the lift; heights tell the floor."""
    plan = tower(3)
    truth = written(
        tmp_path / "truth.csv", f"t,x,y,z\n0,10,1.5,0\n1,10,1.5,0\n2,10,1.5,{STOREY_M}\n3,31,1.5,{STOREY_M}\n"
    )
    track = written(tmp_path / "a.csv", f"t,x,y,level\n0,12,1.5,0\n1,10,5,0\n2,10,1.5,0\n3,{LENGTH_M + 0.5},1.5,1\n")
    card = score(load_path(track, plan), load_path(truth, plan), plan)
    assert card.floor_probability == pytest.approx(0.75)
    assert card.zone_probability == pytest.approx(0.5)


def test_zones_of_the_demo_plan_are_its_rooms() -> None:
    zones = Zones(PLAN)
    rooms = np.array([room.at_m for room in PLAN.levels[0].rooms])
    found = zones.of(rooms, np.zeros(len(rooms)))
    names = [room.name for room in PLAN.levels[0].rooms]
    by_zone = {
        zone: [name for name, other in zip(names, found, strict=True) if other == zone] for zone in found.tolist()
    }
    shared = [zone for zone in by_zone.values() if len(zone) > 1]
    assert shared == [["North corridor", "South corridor"]]  # they are one ring without a door between
    assert NO_ZONE not in found
    assert zones.of(np.array([[-50.0, 0.0]]), np.zeros(1)).tolist() == [NO_ZONE]
    assert zones.of(rooms[:1], np.array([math.nan])).tolist() == [NO_ZONE]


def test_a_lift_is_one_zone_on_each_floor() -> None:
    zones = Zones(tower(2))
    at = np.array([LIFT_AT, (LIFT_AT[0] + 0.4, LIFT_AT[1]), LIFT_AT])
    a, b, c = zones.of(at, np.array([0.0, 0.0, 1.0])).tolist()
    assert a == b != c


@pytest.mark.slow
def test_the_same_figures_as_a_replay_prints(tmp_path: Path) -> None:
    """`echostep replay --truth` and `echostep score` agree to the last bit on our own track.csv."""
    scenario = demo_scenario(PLAN, 3, PythonBoard(3))
    scenario.write_truth(tmp_path / "truth.csv")
    estimates = Tracker(PLAN, scenario.start, seed=3).take(portion_of(walk_chunks()))
    write_track(tmp_path / "track.csv", estimates)
    card = score(load_path(tmp_path / "track.csv", PLAN), load_path(tmp_path / "truth.csv", PLAN), PLAN)
    printed = card_of(estimates, load_truth(tmp_path / "truth.csv", PLAN))
    assert printed is not None
    assert (printed.horizontal, printed.ellipse95_holds) == (card.horizontal, card.ellipse95_holds)


def test_evo_finds_the_same_trajectory_errors(tmp_path: Path) -> None:
    """The absolute trajectory error of evo: translation, without alignment, at the moments of the track."""
    from evo.core.metrics import APE, PoseRelation
    from evo.core.trajectory import PoseTrajectory3D

    rng = np.random.default_rng(5)
    t_s = np.arange(0.0, 60.0, 0.02)
    true = np.column_stack([10.0 * np.sin(0.1 * t_s), 6.0 * np.cos(0.07 * t_s), 0.1 * t_s])
    rows = np.sort(rng.choice(len(t_s), 200, replace=False))
    found = true[rows] + rng.normal(0.0, (0.4, 0.6, 0.2), (200, 3))
    tables = {"truth.csv": np.column_stack([t_s, true]), "track.csv": np.column_stack([t_s[rows], found])}
    for name, table in tables.items():
        np.savetxt(tmp_path / name, table, delimiter=",", header="t,x,y,z", comments="")
    card = score(load_path(tmp_path / "track.csv", None), load_path(tmp_path / "truth.csv", None))
    for ours, third in ((card.spherical, 1.0), (card.horizontal, 0.0)):
        plane = (1.0, 1.0, third)
        ape = APE(PoseRelation.translation_part)
        upright = np.tile([1.0, 0.0, 0.0, 0.0], (int(rows.sum()), 1))
        ape.process_data(tuple(PoseTrajectory3D(xyz * plane, upright, t_s[rows]) for xyz in (true[rows], found)))
        theirs = ape.get_all_statistics()
        assert ours is not None
        assert (ours.mean_m, ours.sd_m, ours.rms_m, ours.median_m, ours.min_m, ours.max_m) == pytest.approx(
            [theirs[key] for key in ("mean", "std", "rmse", "median", "min", "max")], abs=1e-12
        )


def test_every_metric_states_its_unit_and_meaning() -> None:
    assert len({metric.name for metric in METRICS}) == len(METRICS)
    for metric in METRICS:
        assert metric.unit in {"m", "s", "%"}
        assert metric.meaning


def test_different_clocks_are_refused(tmp_path: Path) -> None:
    with pytest.raises(EchostepError, match=r"track.csv: no row within the time .*0 to 4 s.*100 to 101 s.*same clock"):
        scored(tmp_path, "t,x,y\n100,0,0\n101,0,0\n", STANDING)


WRONG = {
    "": r"track.csv:1: the names of the columns are expected",
    "t,x,y\n": r"track.csv: no line of numbers",
    "t,x\n1,2\n": r"track.csv:1: no column for y: it may be named y_m, y, north_m",
    "t,x,y\n1,2\n": r"track.csv:2: 2 cells, but 3 columns",
    "t,x,y\n1,2,3\n\n2,abc,3\n": r"track.csv:4: column x: 'abc' is not a number",
    "t,x,y\n1,,3\n": r"track.csv:2: column x: the cell is empty",
    "t,x,y\n1,inf,3\n": r"track.csv:2: column x: 'inf' is not a finite number",
    "t,x,y\n2,1,3\n1,1,3\n": r"track.csv:3: column t: the time goes back",
    "t,x,y,floor\n2,1,3,cellar\n": r"track.csv:2: column floor: 'cellar' is neither",
    "t,x,y,floor\n2,1,3,1.5\n": r"track.csv:2: column floor: '1.5' is not a whole number",
}


@pytest.mark.parametrize("text", WRONG)
def test_what_is_wrong_is_named(text: str, tmp_path: Path) -> None:
    with pytest.raises(EchostepError, match=WRONG[text]):
        scored(tmp_path, text, STANDING)


def test_lines_and_rows_of_a_hostile_file_are_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    long = written(tmp_path / "long.csv", "t_s,x_m,y_m\n0,0," + "1" * 20_000 + "\n")
    with pytest.raises(EchostepError, match=r"long\.csv: line 2 is longer than 10000 characters"):
        read_csv(long)
    quoted = written(tmp_path / "quoted.csv", 't_s,x_m,y_m\n0,0,"' + "1\n" * 100_000)
    with pytest.raises(EchostepError, match="not a CSV file"):
        read_csv(quoted)
    monkeypatch.setattr(csv_columns, "MOST_ROWS", 3)
    with pytest.raises(EchostepError, match="more than 3 rows"):
        read_csv(written(tmp_path / "many.csv", "t_s,x_m,y_m\n" + "0,0,0\n" * 4))


def test_other_delimiters_capitals_and_a_mark_before_the_names(tmp_path: Path) -> None:
    card = scored(tmp_path, "\ufeff# Time; X; Y\n1;3;4\n2;0;0\n", STANDING)
    assert card.horizontal.mean_m == pytest.approx(2.5)


def test_a_level_by_its_name(tmp_path: Path) -> None:
    plan = tower(3)
    path = written(tmp_path / "a.csv", "t,x,y,floor\n1,0,0,2\n2,0,0,\n")
    level = load_path(path, plan).level
    assert level is not None
    assert (level[0], math.isnan(level[1])) == (2.0, True)
