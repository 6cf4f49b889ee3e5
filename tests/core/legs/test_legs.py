# SPDX-License-Identifier: MIT
"""Strides of simulated people, whose legs know nothing of the estimator: by placed feet (`walker`) and by joint curves (`gaits`)."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep.legs.kinematics import CURVE_SPEED, LegLengths, heel_rise
from echostep.legs.stride import Flag, Stride, StrideSettings
from echostep.legs.strides import StrideEstimator
from echostep_app.cli import app
from echostep_app.offline.leg_csv import LegSamples, load_legs
from echostep_app.offline.leg_side import distance_sd_m
from echostep_app.offline.leg_track import describe_legs, track_default
from echostep_simulation.people.leg_angles import LegDimensions
from echostep_simulation.people.walker import Person, Waypoint, walk
from echostep_studies.papers.profiles import track_lee2010
from echostep_studies.simulation.joint_gait import FAST, NATURAL, SLOW, WalkingPace, draw_person, simulate_gait

STANDARD = LegLengths(0.43, 0.43)


def _strides(t_s: Floats, thigh: Floats, shank: Floats, segments: LegLengths = STANDARD) -> list[Stride]:
    legs = StrideEstimator(StrideSettings(segments))
    return [*legs.feed(t_s, thigh, shank), *legs.finish()]


def _walked(waypoints: list[Waypoint], seed: int = 1, hz: int = 100) -> tuple[Floats, Floats, Floats]:
    """Time, thigh, shank with bias and noise."""
    rng = np.random.default_rng([seed, 1])
    w = walk(waypoints, Person(), np.random.default_rng(seed))
    at = slice(None, None, 1000 // hz)
    bias = 0.02 * rng.standard_normal(2)
    noise = 0.01 * rng.standard_normal((2, len(w.t_s[at])))
    return w.t_s[at], w.thigh_rad_s[at] + bias[0] + noise[0], w.calf_rad_s[at] + bias[1] + noise[1]


def _total(strides: list[Stride]) -> float:
    return sum(s.length_m for s in strides)


def test_five_metres_by_many_people_whose_feet_are_placed() -> None:
    rng, errors = np.random.default_rng(7), []
    for seed in range(16):
        stride = rng.uniform(0.95, 1.55)
        thigh_m = rng.uniform(0.38, 0.47)
        leg = LegDimensions(thigh_m, min(rng.uniform(0.38, 0.47), 1.1 * thigh_m))  # longer shanks include the foot
        person = Person(stride_m=stride, stride_s=1.15 * (1.3 / stride) ** 0.6 * rng.uniform(0.93, 1.07), leg=leg)
        w = walk([(0.0, 0.0), (5.0, 0.0)], person, np.random.default_rng(seed))
        sign, bias = rng.choice([-1.0, 1.0], 2), 0.02 * rng.standard_normal(2)
        thigh, shank = (sign[k] * c[::10] + bias[k] for k, c in enumerate((w.thigh_rad_s, w.calf_rad_s)))
        errors.append(_total(_strides(w.t_s[::10], thigh, shank, LegLengths(leg.thigh_m, leg.shank_m))) / 5.0 - 1.0)
    assert np.abs(errors).mean() < 0.03
    assert np.abs(errors).max() < 0.05


@pytest.mark.slow
@pytest.mark.parametrize(
    ("manner", "seconds", "mean", "flag"),
    [(SLOW, 6.0, 0.04, Flag.SLOW), (NATURAL, 4.0, 0.04, Flag.NONE), (FAST, 3.0, 0.04, Flag.FAST)],
)
def test_people_by_their_joint_curves(manner: WalkingPace, seconds: float, mean: float, flag: Flag) -> None:
    errors, flags = [], []
    for seed in range(16):
        rng = np.random.default_rng(seed)
        person = draw_person(rng)
        gait = simulate_gait(person, manner, seconds, rng)
        strides = _strides(
            gait.t_s, gait.thigh_rad_s, -gait.shank_rad_s, LegLengths(person.leg.thigh_m, person.leg.shank_m)
        )
        errors.append(_total(strides) / float(gait.way_m[-1]) - 1.0)
        flags += [s.flags for s in strides if s.length_m > 0.5 and Flag.EDGE not in s.flags]
    assert np.abs(errors).mean() < mean
    assert sum(flag in f if flag else not f for f in flags) > 0.5 * len(flags)


def test_the_foot_pushes_off_farther_in_a_fast_walk() -> None:
    phase, shank = np.linspace(0.0, 0.6, 61), np.radians(np.linspace(15.0, -40.0, 61))
    still, slow, usual, fast = (heel_rise(phase, shank, speed) for speed in (0.0, 0.365, CURVE_SPEED, 0.565))
    assert np.degrees((fast - usual)[[33, 56]]) == pytest.approx([0.0, 6.0], abs=1e-9)
    assert np.degrees((usual - slow)[[33, 56]]) == pytest.approx([0.0, 3.0], abs=1e-9)
    assert (still >= 0.0).all()


@pytest.mark.parametrize("scale", [0.9, 1.1])
def test_lengths_are_linear_in_the_scale(scale: float) -> None:
    walked = _walked([(0.0, 0.0), (8.0, 0.0)])
    usual, scaled = (_strides(*walked, LegLengths(scale=k)) for k in (1.0, scale))
    steady = [
        (a.length_m, b.length_m) for a, b in zip(usual, scaled, strict=True) if not a.flags & ~Flag.SLOW & ~Flag.FAST
    ]
    assert len(steady) > 3
    assert all(b == pytest.approx(scale * a) for a, b in steady)


def test_a_poor_gyro_learns_its_bias_while_he_stands() -> None:
    t, thigh, shank = _walked([(0.0, 0.0), (6.0, 0.0)])
    assert _total(_strides(t, thigh + 0.15, shank - 0.12)) == pytest.approx(_total(_strides(t, thigh, shank)), rel=0.01)


@pytest.mark.parametrize("hz", [50, 200, 500])
def test_any_rate(hz: int) -> None:
    assert _total(_strides(*_walked([(0.0, 0.0), (20.0, 0.0)], hz=hz))) == pytest.approx(20.0, rel=0.05)


@pytest.mark.parametrize("thigh_sign", [1.0, -1.0])
@pytest.mark.parametrize("shank_sign", [1.0, -1.0])
def test_any_sign(thigh_sign: float, shank_sign: float) -> None:
    t, thigh, shank = _walked([(0.0, 0.0), (8.0, 0.0)])
    usual = _strides(t, thigh, shank)
    assert _total(_strides(t, thigh_sign * thigh, shank_sign * shank)) == pytest.approx(_total(usual), abs=1e-9)


def test_portions_do_not_matter() -> None:
    t, thigh, shank = _walked([(0.0, 0.0), (9.0, 0.0, 2.0), (9.0, 6.0)])
    legs, found = StrideEstimator(), []
    for a, b in ((0, 1), (1, 333), (333, 900), (900, len(t))):
        found += legs.feed(t[a:b], thigh[a:b], shank[a:b])
    assert [*found, *legs.finish()] == _strides(t, thigh, shank, LegLengths())


def test_strides_follow_each_other_and_say_how_well() -> None:
    strides = _strides(*_walked([(0.0, 0.0), (25.0, 0.0, 3.0), (25.0, 20.0)]))
    assert all(a.t_end_s <= b.t_start_s + 0.02 for a, b in zip(strides, strides[1:], strict=False))
    assert abs(_total(strides) - 45.0) < 3.0 * distance_sd_m(strides)
    assert sum(Flag.STANDING in s.flags for s in strides) >= 2


def test_backward_is_flagged_and_not_counted() -> None:
    t, thigh, shank = _walked([(0.0, 0.0), (10.0, 0.0)])
    n = len(t)
    twice_s: Floats = np.arange(2.0 * n) * 0.01
    strides = _strides(twice_s, np.concatenate([thigh, -thigh[::-1]]), np.concatenate([shank, -shank[::-1]]))
    back = [s for s in strides if Flag.BACKWARD in s.flags]
    assert len(back) >= 4
    assert all(s.length_m == 0.0 and s.length_sd_m > 0.3 and s.t_start_s > 0.9 * n * 0.01 for s in back)
    assert _total(strides) == pytest.approx(10.0, abs=1.6)


def test_marching_in_place_is_not_a_way() -> None:
    t, thigh, shank = _walked([(0.0, 0.0), (8.0, 0.0)])
    after = np.arange(0.0, 20.0, 0.01)
    moves = np.clip((after - 2.0) / 1.0, 0.0, 1.0) * np.clip((18.0 - after) / 1.0, 0.0, 1.0)
    lifted = moves * np.clip(np.sin(2 * math.pi * after / 1.2), 0.0, None) ** 2
    marched = [np.concatenate([a, np.gradient(k * lifted, after)]) for a, k in ((thigh, 0.7), (shank, -0.6))]
    strides = _strides(np.concatenate([t, t[-1] + 0.01 + after]), marched[0], marched[1])
    in_place = [s for s in strides if s.t_start_s > t[-1] and Flag.STANDING not in s.flags]
    assert _total(strides) == pytest.approx(8.0, abs=1.0)
    assert sum(Flag.UNSEEN in s.flags and s.length_sd_m > 0.3 for s in in_place) > 0.8 * len(in_place)


def test_stairs_are_recognised() -> None:
    for z0, z1, flag in ((3.5, 0.0, Flag.STAIRS_DOWN), (0.0, 3.5, Flag.STAIRS_UP)):
        way: list[Waypoint] = [(0.0, 0.0, 0.0, z0), (12.0, 0.0, 0.0, z0), (18.0, 0.0, 0.0, z1), (30.0, 0.0, 0.0, z1)]
        strides = _strides(*_walked(way))
        found = [s for s in strides if s.flags & (Flag.STAIRS_UP | Flag.STAIRS_DOWN)]
        assert 6 <= len(found) <= 14
        assert all(flag in s.flags and s.rise_m * (z1 - z0) > 0.0 for s in found)
        assert _total(strides) == pytest.approx(30.0, rel=0.06)


def test_a_gap_is_bridged_and_said() -> None:
    t, thigh, shank = _walked([(0.0, 0.0), (20.0, 0.0)])
    kept = (t < 9.0) | (t > 10.5)
    strides = _strides(t[kept], thigh[kept], shank[kept])
    assert sum(Flag.GAP in s.flags for s in strides) == 1
    assert _total(strides) == pytest.approx(20.0, rel=0.1)


def test_a_long_gap_is_unobserved() -> None:
    t, thigh, shank = _walked([(0.0, 0.0), (20.0, 0.0)])
    later = np.where(t > 9.0, t + 1e6, t)
    strides = _strides(later, thigh, shank)
    assert _total(strides) < 21.0
    assert any(Flag.GAP in s.flags and s.length_m == 0.0 and s.length_sd_m > 10.0 for s in strides)
    for method in (track_default, track_lee2010):
        nothing = np.full(len(t), np.nan)
        rows = method(LegSamples(later, thigh, shank, nothing, nothing), StrideSettings(STANDARD)).rows
        assert rows[-1, 1] < 25.0


@pytest.mark.parametrize("size", [0.3, 1.0, 10.0])
@pytest.mark.parametrize("seed", range(3))
def test_noise_is_no_walk(size: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    nothing = np.full(3000, np.nan)
    thigh, shank = size * rng.standard_normal((2, 3000))
    t: Floats = np.arange(3000.0) * 0.01
    samples = LegSamples(t, thigh, shank, nothing, nothing)
    found = describe_legs(track_default(samples, StrideSettings()))
    assert "do not trust" in found or "no step was seen" in found or "exchanged" in found


def test_exchanged_columns_are_guessed() -> None:
    t, thigh, shank = _walked([(0.0, 0.0), (20.0, 0.0)])
    nothing = np.full(len(t), np.nan)
    assert "exchanged" in describe_legs(track_default(LegSamples(t, shank, thigh, nothing, nothing), StrideSettings()))


def test_nonsense_is_counted() -> None:
    t, thigh, shank = _walked([(0.0, 0.0), (8.0, 0.0)])
    bad = thigh.copy()
    bad[::50], bad[25::50] = math.nan, 1e9
    legs = StrideEstimator()
    found = [*legs.feed(t, bad, shank), *legs.finish()]
    assert legs.counts.impossible == len(bad[::50]) + len(bad[25::50])
    assert _total(found) == pytest.approx(8.0, rel=0.08)
    assert _strides(np.empty(0), np.empty(0), np.empty(0)) == []
    assert _total(_strides(t, np.zeros_like(t), np.zeros_like(t))) == 0.0


def test_a_shank_to_the_floor_is_seen() -> None:
    whole = LegLengths(0.48, 0.56)
    assert whole.measured_to_floor
    assert whole.to_ankle_m == pytest.approx(0.483, abs=0.001)
    assert LegLengths(0.43, 0.43).to_ankle_m == 0.43


def _samples(seed: int = 3) -> LegSamples:
    rng = np.random.default_rng(seed)
    w = walk([(0.0, 0.0), (15.0, 0.0), (15.0, 10.0)], Person(), rng)
    at = slice(None, None, 5)
    compass = np.where(
        np.arange(len(w.t_s[at])) % 20 == 0, w.heading_rad[at] + 0.05 * rng.standard_normal(len(w.t_s[at])), np.nan
    )
    return LegSamples(w.t_s[at], w.thigh_rad_s[at], -w.calf_rad_s[at], -w.belt_rad_s[at], compass)


@pytest.mark.parametrize("method", [track_default, track_lee2010])
def test_the_track_turns_the_corner(method: type) -> None:
    rows = method(_samples(), StrideSettings(STANDARD)).rows
    assert rows.shape[1] == 6
    assert np.hypot(rows[-1, 4] - 15.0, rows[-1, 5] - 10.0) < 2.5
    assert rows[-1, 1] == pytest.approx(25.0, rel=0.1)


def _write(path: Path, header: str, rows: Floats) -> Path:
    path.write_text(
        "\n".join([header, *(",".join("" if math.isnan(v) else f"{v:.6f}" for v in row) for row in rows.tolist())])
        + "\n"
    )
    return path


HEADER = "t_s,thigh_rad_s,shank_rad_s"


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda r: r * [1.0, 57.3, 57.3], "deg/s"),
        (lambda r: r * [1000.0, 1.0, 1.0], "milliseconds"),
        (lambda r: r * [1.0, 0.0, 1.0], "thigh_rad_s is constant"),
        (lambda r: r[:, [0, 1, 1]], "same numbers"),
        (lambda r: r[::30], "50 at least"),
        (lambda r: np.where(np.arange(len(r))[:, None] % 4 > 0, np.nan, r), "no number"),
        (lambda r: r[:1], "no samples"),
    ],
)
def test_bad_files_are_named(tmp_path: Path, change: object, words: str) -> None:
    rows = np.column_stack(_walked([(0.0, 0.0), (8.0, 0.0)]))
    assert callable(change)
    path = _write(tmp_path / "legs.csv", HEADER, change(rows))
    with pytest.raises(EchostepError, match=words):
        load_legs(path)


def test_a_header_in_degrees_and_other_files(tmp_path: Path) -> None:
    (tmp_path / "deg.csv").write_text("t_s,thigh_deg_s,shank_deg_s\n0,1,2\n")
    with pytest.raises(EchostepError, match="looks like degrees"):
        load_legs(tmp_path / "deg.csv")
    (tmp_path / "noise.bin").write_bytes(np.random.default_rng(1).bytes(40_000))
    with pytest.raises(EchostepError, match="no column"):
        load_legs(tmp_path / "noise.bin")
    with pytest.raises(EchostepError, match="cannot read"):
        load_legs(tmp_path / "none.csv")


def test_three_axes_give_the_track_of_one(tmp_path: Path) -> None:
    t, thigh, shank = _walked([(0.0, 0.0), (10.0, 0.0)])
    axis = np.array([0.48, 0.6, 0.64])
    rows = np.column_stack([t, np.outer(thigh, axis), np.outer(-shank, axis[::-1])])
    header = "t_s,thigh_x,thigh_y,thigh_z,shank_x,shank_y,shank_z"
    found = load_legs(_write(tmp_path / "three.csv", header, rows))
    one = load_legs(_write(tmp_path / "one.csv", HEADER, np.column_stack([t, thigh, shank])))
    distance = [track_default(samples, StrideSettings(STANDARD)).distance_m for samples in (found, one)]
    assert distance[0] == pytest.approx(distance[1], abs=0.02)
    assert any("thigh: the axis of walking is 50 degrees from the sensor's z" in note for note in found.notes)
    with pytest.raises(EchostepError, match="no column thigh_rad_s"):
        load_legs(_write(tmp_path / "two.csv", header.replace("thigh_z", "thigh_w"), rows))
    circle = [np.sin(6.0 * t), np.cos(6.0 * t), 0.1 * np.sin(t)]
    round_ = np.column_stack([t, *circle, *circle[::-1]])
    assert any("no axis of walking" in note for note in load_legs(_write(tmp_path / "round.csv", header, round_)).notes)
    round_[:-5, 1] = np.nan
    with pytest.raises(EchostepError, match="number"):
        load_legs(_write(tmp_path / "holes.csv", header, round_))


def test_the_command_and_its_calibration(tmp_path: Path) -> None:
    rows = np.column_stack(_walked([(0.0, 0.0), (10.0, 0.0)]))
    path, out = _write(tmp_path / "legs.csv", HEADER, rows), tmp_path / "track.csv"
    base = ["legs", str(path), "--thigh", "0.43", "--shank", "0.43", "--out", str(out)]
    shown = CliRunner().invoke(app, [*base, "--walked", "10"])
    assert shown.exit_code == 0
    scale = shown.output.split("--scale ")[1].split()[0]
    again = CliRunner().invoke(app, [*base, "--scale", scale, "--picture", str(picture := tmp_path / "legs.pdf")])
    assert picture.read_bytes()[:4] == b"%PDF"
    assert f"track: {out}, picture: {picture}" in again.output.replace("\n", "")
    assert "stride 1: " in again.output
    assert "beginning or end of a walk" in again.output
    assert "10.00 m" in again.output
    assert out.read_text().splitlines()[0] == "t_s,distance_m,speed_m_s,heading_rad,x,y"
    assert CliRunner().invoke(app, [*base, "--profile", "lee2010"]).exit_code == 0
    for extra in (["--profile", "x"], ["--scale", "9"], ["--walked", "99"], ["--thigh", "43"]):
        assert isinstance(CliRunner().invoke(app, [*base, *extra]).exception, EchostepError)
