# SPDX-License-Identifier: MIT
"""The trails of [Fischer 2008]: the field of machines, the walks, the judgement, the study; our heading by machinery is a regression case."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from echostep.arrays import Floats
from echostep.foot.steps import FootCounts, Track
from echostep_app.cli import app
from echostep_simulation.devices.mtx import MtxModel, measure
from echostep_simulation.devices.onboard_filter import OnBoardFilter
from echostep_simulation.people.walker import Walk
from echostep_simulation.world.magnetic_field import EARTH_T, MagneticDipole, MagneticField, dipole
from echostep_studies.noplan.trails import METHODS, RATES_HZ, JudgedTrack, TrailRun, judge, summarize, track
from echostep_studies.papers import fischer2008
from echostep_studies.simulation.fischer_trails import TRAILS, Trail, measure_trail, walk_trail

BY_NAME = {trail.name: trail for trail in TRAILS}
SEEDS = (1, 2, 3)


# ---- machines ----


def potential(place: Floats, machine: MagneticDipole) -> float:
    """Of the field in earth units times metres: H is minus its gradient."""
    away = place - np.array(machine.at_m)
    return float(1e-7 / EARTH_T * np.dot(machine.moment_a_m2, away) / np.linalg.norm(away) ** 3)


def test_a_machine_s_field_is_the_gradient_of_a_dipole_s_potential() -> None:
    rng = np.random.default_rng(4)
    machine = MagneticDipole((1.0, -2.0, 0.6), (300.0, -800.0, 500.0))
    for place in np.array(machine.at_m) + 2.0 * rng.standard_normal((20, 3)):
        if np.linalg.norm(place - machine.at_m) < 0.6:
            continue
        steps = 1e-4 * np.eye(3)
        slope = [(potential(place + h, machine) - potential(place - h, machine)) / 2e-4 for h in steps]
        assert dipole(place[None], machine)[0] == pytest.approx(-np.array(slope), rel=1e-4, abs=1e-7)


def test_a_field_at_a_printed_place() -> None:
    """On the axis the field is 2 (mu0 / 4 pi) m / r3: 1000 A m2 give 25 uT at 2 m."""
    found = dipole(np.array([[2.0, 0.0, 0.0], [0.0, 0.0, 0.0]]), MagneticDipole((0.0, 0.0, 0.0), (1000.0, 0.0, 0.0)))
    assert found[0] * EARTH_T == pytest.approx([25e-6, 0.0, 0.0])
    assert np.isfinite(found).all()


def test_machines_add_to_a_building_that_stays_the_same() -> None:
    places = np.random.default_rng(1).uniform(0.0, 40.0, (50, 2))
    machine = MagneticDipole((20.0, 20.0, 0.6), (500.0, 0.0, 0.0))
    plain, with_machine = (MagneticField(np.random.default_rng(2), m).field(places) for m in ((), (machine,)))
    added = dipole(np.column_stack([places, np.full(50, 0.1)]), machine)
    assert with_machine == pytest.approx(plain + added)


# ---- trails and walks ----


@pytest.mark.parametrize("trail", TRAILS, ids=lambda trail: trail.name)
def test_a_trail_is_as_long_as_printed_ends_at_its_start_and_misses_the_machines(trail: Trail) -> None:
    way = np.array([waypoint[:2] for waypoint in trail.waypoints])
    assert np.hypot(*np.diff(way, axis=0).T).sum() == pytest.approx(trail.length_m, rel=0.03)
    assert np.hypot(*(way[-1] - way[0])) <= 1.01
    for machine in trail.machines:
        for a, b in zip(way, way[1:], strict=False):
            share = np.clip((machine.at_m[:2] - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
            assert np.hypot(*(a + share * (b - a) - machine.at_m[:2])) >= 1.0


@pytest.fixture(scope="module")
def short_walk() -> Walk:
    return walk_trail(BY_NAME["rectangle"], 1)


def test_another_seed_is_another_person_and_the_same_seed_the_same_bytes(short_walk: Walk) -> None:
    same, other = (walk_trail(BY_NAME["rectangle"], seed) for seed in (1, 2))
    assert same.foot_m.tobytes() == short_walk.foot_m.tobytes()
    assert other.foot_m.shape != short_walk.foot_m.shape
    one, two = (measure_trail(BY_NAME["rectangle"], short_walk, 100, 1) for _ in range(2))
    assert one.orientation.tobytes() == two.orientation.tobytes()


def test_the_filter_on_board_changes_only_what_the_mtx_believes(short_walk: Walk) -> None:
    plain, fooled = (
        measure(short_walk, MtxModel(filter=settings), np.random.default_rng(3)) for settings in (None, OnBoardFilter())
    )
    assert plain.accel.tobytes() == fooled.accel.tobytes()
    assert plain.mag.tobytes() == fooled.mag.tobytes()
    assert np.abs(plain.orientation - fooled.orientation).max() > 0.001


def test_a_well_behaved_filter_makes_the_paper_s_method_accurate(short_walk: Walk) -> None:
    """With attitudes that follow the truth the method is right, so that its errors on the trails are the filter's."""
    model = MtxModel(gyro_noise=0.0, gyro_bias_rad_s=0.0, accel_noise=0.0, accel_bias_m_s2=0.0, lean_rad=0.0)
    samples = measure(short_walk, model, np.random.default_rng(3))
    found = fischer2008.walk_track(samples.t_s, samples.accel, samples.gyro, samples.orientation)
    assert judge(found, short_walk).errors_m.max() < 0.25


# ---- judgement ----


def true_track(walked: Walk) -> Track:
    """What a method would tell that makes no error: places from the first, turned as if the foot had pointed along x."""
    yaw = walked.foot_rpy_rad[:, 2]
    c, s = np.cos(-yaw[0]), np.sin(-yaw[0])
    away = walked.foot_m - walked.foot_m[0]
    away[:, :2] = away[:, :2] @ np.array([[c, s], [-s, c]])
    return Track(walked.t_s, away, yaw - yaw[0], walked.flat, [], FootCounts(0, 0, 0, 0, 0, 0))


def test_a_true_track_has_no_errors_and_a_turned_one_those_of_the_turn(short_walk: Walk) -> None:
    track_ = true_track(short_walk)
    perfect = judge(track_, short_walk)
    assert perfect.errors_m.max() < 0.01
    assert perfect.heading_errors_rad.max() < 0.01
    assert perfect.true_distance_m == pytest.approx(11.0, abs=0.6)
    turned = judge(replace(track_, heading_rad=track_.heading_rad + 2.0 * np.pi - 0.3), short_walk)
    assert turned.heading_errors_rad == pytest.approx(np.full(len(turned.errors_m), 0.3), abs=0.01)
    assert turned.errors_m == pytest.approx(perfect.errors_m)


# ---- by machinery ----


@pytest.fixture(scope="module")
def by_machinery() -> dict[tuple[int, int, str], JudgedTrack]:
    trail, found = BY_NAME["machinery"], {}
    for seed in SEEDS:
        walked = walk_trail(trail, seed)
        for rate_hz in RATES_HZ:
            samples = measure_trail(trail, walked, rate_hz, seed)
            for profile in METHODS:
                found[seed, rate_hz, profile] = judge(track(samples, profile), walked)
    return found


def test_our_heading_holds_by_machinery_where_the_paper_s_is_unusable(
    by_machinery: dict[tuple[int, int, str], JudgedTrack],
) -> None:
    """The corridor of Figure 6. A magnetometer that is fused without distrust fails here; gyros alone drift by some degrees in four minutes."""
    for (_, _, profile), walked in by_machinery.items():
        worst_deg = float(np.degrees(walked.heading_errors_rad.max()))
        if profile == "default":
            assert worst_deg < 20.0
            assert walked.errors_m.max() < 12.0
            assert abs(walked.distance_m / walked.true_distance_m - 1.0) < 0.01
        else:
            assert worst_deg > 40.0
            assert walked.errors_m.max() > 12.0


def test_it_is_the_machines_that_turn_the_paper_s_heading() -> None:
    trail = BY_NAME["machinery"]
    walked = walk_trail(trail, 1)
    samples = measure_trail(replace(trail, machines=()), walked, 100, 1)
    assert np.degrees(judge(track(samples, "fischer2008"), walked).heading_errors_rad.max()) < 25.0


# ---- the study ----


def test_the_figures_have_the_printed_magnitudes() -> None:
    """As the model was set: the printed distance errors +2, -8 and -7 % are within the range of ten walkers."""
    means = []
    for name in ("line", "l", "rectangle"):
        trail = BY_NAME[name]
        off = []
        for seed in range(1, 11):
            walked = walk_trail(trail, seed)
            found = judge(track(measure_trail(trail, walked, 100, seed), "fischer2008"), walked)
            off.append(100.0 * (found.distance_m / found.true_distance_m - 1.0))
        assert trail.printed_percent is not None
        assert min(off) < trail.printed_percent < max(off)
        means.append(float(np.mean(off)))
    assert np.mean(means) == pytest.approx((2.0 - 8.0 - 7.0) / 3.0, abs=0.5)


@pytest.mark.long
def test_the_command_writes_rows_for_every_trail_method_and_rate(tmp_path: Path) -> None:
    options = ["--runs", "1", "--seed", "4", "--out", str(tmp_path), "--json", str(tmp_path / "r.json")]
    found = CliRunner().invoke(app, ["evaluate", "noplan", "--rows", "trail/*", *options])
    assert found.exit_code == 0, found.output
    results = json.loads((tmp_path / "r.json").read_text())
    assert (results["study"], results["runs"], results["seed"]) == ("noplan", 1, 4)
    rows = {row["name"]: row for row in results["rows"]}
    assert len(rows) == len(TRAILS) * len(METHODS) * len(RATES_HZ)
    assert rows["trail/line/fischer2008"]["printed_distance_error_percent"] == 2.0
    assert rows["trail/l/default/50Hz"]["rate_hz"] == 50
    for row in rows.values():
        assert row["min_m"] <= row["mean_m"] <= row["max_m"]
        assert row["coverage95"] is None
    assert "printed" in found.output


def test_a_summary_is_over_all_runs() -> None:
    row = TrailRun(
        name="trail/line/default", profile="default", rate_hz=100, distance_m=88.0, distance_error_percent=1.0,
        heading_error_deg=2.0, heading_max_deg=5.0, errors_m=[0.0, 1.0],
    )  # fmt: skip
    other = replace(row, distance_error_percent=-3.0, heading_max_deg=9.0, errors_m=[1.0, 4.0])
    found = summarize([row, other])
    assert (found["distance_error_percent"], found["heading_max_deg"], found["ending_m"]) == (-1.0, 9.0, 2.5)
    assert (found["distance_error_min_percent"], found["lost"], found["runs"]) == (-3.0, 1, 2)
