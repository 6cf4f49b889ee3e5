# SPDX-License-Identifier: MIT
"""Sensors that are strapped on legs anyhow: the axis of walking, leaks from turns, signs; both legs of one person."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep.legs.angle_grid import AngleGrid
from echostep.legs.gyro_bias import GyroBias
from echostep.legs.leg_angles import LegAngles, SwingAngles
from echostep.legs.stride import Flag, Stride, StrideSettings
from echostep.legs.strides import StrideEstimator
from echostep.legs.walking_bout import Swing, leaving_share, stairs_flag
from echostep_app.offline.leg_csv import LegSamples, load_pair
from echostep_app.offline.leg_gyros import walking_axis
from echostep_app.offline.leg_pair import LEGS_DIFFER, track_pair
from echostep_app.offline.leg_side import HALF_PELVIS_M, about_trunk, distance_sd_m, leg_left_m
from echostep_app.offline.leg_track import doubts, track_default
from echostep_simulation.people.walker import Person, Walk, Waypoint, walk
from foot.foot_walks import any_rotation

CORNER: list[Waypoint] = [(0.0, 0.0), (6.0, 0.0), (6.0, 6.0)]


@pytest.fixture(scope="module")
def walked() -> Walk:
    return walk(CORNER, Person(), np.random.default_rng(4))


def _strides(t_s: Floats, thigh: Floats, shank: Floats, belt: Floats | None) -> list[Stride]:
    legs = StrideEstimator()
    return [*legs.feed(t_s, thigh, shank, belt), *legs.finish()]


@pytest.mark.parametrize("seed", range(3))
def test_the_axis_of_walking_is_found_from_three_axes(walked: Walk, seed: int) -> None:
    rng = np.random.default_rng(seed)
    t_s, pitch, yaw = walked.t_s[::10], walked.thigh_rad_s[::10], walked.belt_rad_s[::10]
    impacts = 3.0 * np.sin(2.0 * math.pi * 13.0 * t_s) * (np.sin(2.0 * math.pi * 0.9 * t_s) > 0.9)
    body = np.column_stack([0.05 * rng.standard_normal(len(t_s)), pitch, yaw + impacts])
    mounted = any_rotation(rng)
    found = walking_axis(t_s, body @ mounted.T)
    assert abs(float(found.axis @ mounted[:, 1])) > math.cos(math.radians(8.0))
    assert found.clear
    assert not walking_axis(t_s, rng.standard_normal((len(t_s), 3))).clear


@pytest.mark.parametrize("span_s", [2.6, 4.0, 8.0])
def test_soft_tissue_that_turns_faster_than_the_leg_swings_does_not_take_the_axis(walked: Walk, span_s: float) -> None:
    """Two to four times a stride the thigh's soft tissue turns the sensor about the leg, in the sum faster than the leg swings."""
    at = (walked.t_s > 2.5) & (walked.t_s < 2.5 + span_s)
    t_s, pitch = walked.t_s[at][::10], walked.thigh_rad_s[at][::10]
    wobble = sum(2.0 * np.sin(2.0 * math.pi * 0.95 * k * t_s + k) for k in (2, 3, 4))
    found = walking_axis(t_s, np.column_stack([0.1 * wobble, pitch, wobble]))
    assert abs(float(found.axis[1])) > math.cos(math.radians(15.0))


def test_turns_that_leak_into_the_pitch_cost_no_length_and_make_no_stairs(walked: Walk) -> None:
    t_s, thigh, shank, belt = (c[::10] for c in (walked.t_s, walked.thigh_rad_s, walked.calf_rad_s, walked.belt_rad_s))
    level = sum(s.length_m for s in _strides(t_s, thigh, shank, belt))
    leaking = thigh + 0.3 * belt, shank - 0.2 * belt
    found = _strides(t_s, *leaking, belt)
    assert not any(s.flags & (Flag.STAIRS_UP | Flag.STAIRS_DOWN) for s in found)
    assert sum(s.length_m for s in found) == pytest.approx(level, abs=0.25)
    assert abs(sum(s.length_m for s in _strides(t_s, *leaking, None)) - level) > 0.0


def test_bias_and_leak_are_told_apart() -> None:
    bias = GyroBias()
    for turn in (0.0, 0.0, 1.2, -0.8, 0.0):
        bias.learn(0.03 + 0.25 * turn, math.radians(1.0), turn)
    assert bias.value == pytest.approx(0.03, abs=0.01)
    assert bias.leak == pytest.approx(0.25, abs=0.03)
    before = bias.value, bias.variance
    bias.learn(2.0, math.radians(1.0))  # no rest, or no stride
    assert (bias.value, bias.variance) == before


def test_a_brief_rest_says_less_about_the_level() -> None:
    known = SwingAngles(math.radians(15.0), math.radians(-20.0), 0, math.radians(3.0) ** 2)
    assert known.standing(3.0).thigh < known.standing(0.4).thigh < known.thigh
    assert SwingAngles().standing(3.0).thigh == pytest.approx(0.0, abs=0.01)


def test_stairs_need_a_knee_that_moves_and_hips_that_rise() -> None:
    up, half = math.radians(60.0), math.radians(12.0)
    assert stairs_flag(up, half, 0.15) is Flag.STAIRS_UP
    assert stairs_flag(half, up, -0.15) is Flag.STAIRS_DOWN
    assert stairs_flag(up, half, -0.05) is Flag.NONE  # the hips sink
    assert stairs_flag(math.radians(45.0), math.radians(41.0), 0.15) is Flag.NONE  # drift bends the knee all the time


def test_the_hips_are_slow_in_the_first_and_in_the_closing_swing() -> None:
    steady, closing = Swing(1.2, 1.2, 0.2, 0.2), Swing(1.2, 0.1, 0.2, 0.2)
    assert steady.first_half_m() + steady.second_half_m() == pytest.approx(0.48)
    assert 0.04 < closing.second_half_m() < 0.09  # what real bodies have to go at mid swing
    assert leaving_share(0.0, 0.4) < 0.3 < leaving_share(0.4, 0.4) == 1.0
    assert leaving_share(0.1, 0.0) < 0.3


def test_motion_before_the_walk_does_not_fix_the_signs(walked: Walk) -> None:
    t_s, thigh, shank = (c[::10] for c in (walked.t_s, walked.thigh_rad_s, walked.calf_rad_s))
    before_s = np.arange(0.0, 6.0, 0.01)
    lifts = np.clip(np.minimum(before_s - 1.0, 4.5 - before_s), 0.0, 0.3) * np.sin(2.0 * math.pi * 0.8 * before_s)
    # The foot drawn back, knee bent
    joined = [np.concatenate([k * lifts, c]) for c, k in ((thigh, -6.0), (shank, 9.0))]
    times = np.arange(0.0, len(joined[0])) * 0.01
    nothing = np.full(len(times), np.nan)
    live = StrideEstimator()
    live.feed(times, joined[0], joined[1])
    assert live.revised
    strides = track_default(LegSamples(times, joined[0], joined[1], nothing, nothing), StrideSettings()).strides
    later = sum(s.length_m for s in strides if s.t_start_s > 5.5)
    assert later == pytest.approx(sum(s.length_m for s in _strides(t_s, thigh, shank, None)), abs=0.4)


@pytest.mark.parametrize("sign", [(1.0, -1.0), (-1.0, 1.0)])
def test_a_walk_that_is_taken_for_none_is_uncertain_by_its_length(walked: Walk, sign: tuple[float, float]) -> None:
    """With a wrong sign the leg shows no walk: what it then does not show may be as long as the walk."""
    t_s, thigh, shank = (c[::10] for c in (walked.t_s, walked.thigh_rad_s, walked.calf_rad_s))
    legs = StrideEstimator(sign=sign)
    strides = (*legs.feed(t_s, thigh, shank), *legs.finish())
    missing_m = 12.0 - sum(s.length_m for s in strides)
    assert missing_m > 6.0
    assert missing_m < 2.0 * distance_sd_m(strides)
    assert doubts(strides)
    assert doubts(strides[:2])


def test_the_side_of_the_leg_is_found_by_the_pelvis_and_counts_in_turns(walked: Walk) -> None:
    t_s, thigh, shank = (c[::10] for c in (walked.t_s, walked.thigh_rad_s, walked.calf_rad_s))
    strides, heading = tuple(_strides(t_s, thigh, shank, None)), walked.heading_rad[::10]  # of the right leg
    assert leg_left_m(strides, t_s, heading) == -leg_left_m(strides, t_s, -heading)
    assert -HALF_PELVIS_M <= leg_left_m(strides, t_s, heading) < -0.95 * HALF_PELVIS_M
    assert leg_left_m(strides, t_s, np.zeros_like(t_s)) == 0.0
    trunk = about_trunk(strides, t_s, heading)  # a turn to the left: the right leg is outside
    assert sum(s.length_m for s in strides) - sum(s.length_m for s in trunk) == pytest.approx(
        0.09 * math.pi / 2, abs=0.03
    )
    assert about_trunk(strides, t_s, np.zeros_like(t_s)) is strides


def test_a_weak_twist_of_the_belt_decides_the_side_in_part(walked: Walk) -> None:
    t_s, thigh, shank = (c[::10] for c in (walked.t_s, walked.thigh_rad_s, walked.calf_rad_s))
    strides, heading = tuple(_strides(t_s, thigh, shank, None)), walked.heading_rad[::10]
    weak, clear = leg_left_m(strides, t_s, 0.1 * heading), leg_left_m(strides, t_s, heading)
    assert clear < 0.9 * clear < weak < 0.1 * clear < 0.0
    assert leg_left_m(strides[:3], t_s, heading) < 0.0  # few strides count, too


def test_a_turn_by_a_leak_that_is_not_known_makes_the_level_uncertain() -> None:
    """Half a turn with a sensor tilted by 17 degrees leaks 54 degrees into the pitch: the next strides must be able to mend that."""
    assert _level_sd_deg(0.0, learnt=False) < 10.0
    assert _level_sd_deg(math.pi, learnt=False) > 54.0
    assert _level_sd_deg(math.pi, learnt=True) < 10.0


def _level_sd_deg(turn_rad: float, *, learnt: bool) -> float:
    """Standard deviation of a level known to 4 degrees after a second in which the trunk turns; `learnt`: the leak is known from turns before."""
    grid = AngleGrid()
    for k in range(101):
        grid.add(0.01 * k, 0.3 * turn_rad, 0.3 * turn_rad, turn_rad)
    angles = LegAngles(grid)
    for bias in angles.bias if learnt else ():
        for turn in (math.pi, 0.0) * 20:
            bias.learn(0.3 * turn, math.radians(1.0), turn)
    angles.level = SwingAngles(variance=math.radians(4.0) ** 2)
    angles.move_level((1.0, 1.0), len(grid) - 1)
    return math.degrees(math.sqrt(angles.level.variance))


LONGER = 1.06  # by which the second leg swings farther
KEYS = ("thigh_rad_s", "shank_rad_s")


@pytest.fixture(scope="module")
def legs() -> tuple[LegSamples, LegSamples]:
    """30 m with a corner: a leg, and one whose angles are larger."""
    w = walk([(0.0, 0.0), (20.0, 0.0), (20.0, 10.0)], Person(), np.random.default_rng(4))
    t_s, thigh, shank, belt = (c[::10] for c in (w.t_s, w.thigh_rad_s, w.calf_rad_s, w.belt_rad_s))
    nothing = np.full(len(t_s), np.nan)
    first = LegSamples(t_s, thigh, shank, belt, nothing)
    return first, LegSamples(t_s, -LONGER * thigh, LONGER * shank, nothing, nothing)


def _between(samples: LegSamples, begin_s: float, end_s: float) -> LegSamples:
    inside = (samples.t_s >= begin_s) & (samples.t_s < end_s)
    columns = (getattr(samples, k)[inside] for k in ("t_s", "thigh", "shank", "belt", "compass"))
    return LegSamples(*columns)


def test_the_mean_of_both_with_a_smaller_uncertainty(legs: tuple[LegSamples, LegSamples]) -> None:
    alone = [track_default(replace(leg, belt=legs[0].belt), StrideSettings()).distance_m for leg in legs]
    assert alone[1] > 1.02 * alone[0]
    pair = track_pair(*legs, StrideSettings())
    assert pair.distance_m == pytest.approx(np.mean(alone), rel=0.005)
    assert sum(s.length_m for s in pair.strides) == pytest.approx(pair.distance_m, abs=0.01)
    assert track_pair(*legs[::-1], StrideSettings()).distance_m == pytest.approx(pair.distance_m, rel=0.002)
    scale_sd = np.sqrt(StrideSettings().scale_sd ** 2 - LEGS_DIFFER**2 / 4.0)
    assert distance_sd_m(pair.strides) == pytest.approx(scale_sd * pair.distance_m, rel=0.05)
    assert any("the other leg measures" in note and "more" in note for note in pair.notes)
    assert np.hypot(pair.rows[-1, 4] - 20.0, pair.rows[-1, 5] - 10.0) < 2.0


def test_one_leg_goes_on_with_the_scale_of_both(legs: tuple[LegSamples, LegSamples]) -> None:
    first, other = legs
    whole = track_pair(first, other, StrideSettings()).distance_m
    middle_s = float(first.t_s[len(first.t_s) // 2])
    for pair in ((first, _between(other, -1.0, middle_s)), (_between(first, -1.0, middle_s), other)):
        found = track_pair(pair[0], replace(pair[1], belt=np.full(len(pair[1].t_s), np.nan)), StrideSettings())
        assert found.distance_m == pytest.approx(whole, rel=0.015)
        assert sum(s.length_m for s in found.strides) == pytest.approx(found.distance_m, abs=0.01)


def test_a_gap_of_one_leg_is_seen_by_the_other(legs: tuple[LegSamples, LegSamples]) -> None:
    first, other = legs
    hole = (first.t_s < 8.0) | (first.t_s > 13.0)
    columns = [getattr(first, k)[hole] for k in ("t_s", "thigh", "shank", "belt", "compass")]
    found = track_pair(LegSamples(*columns), other, StrideSettings())
    assert found.distance_m == pytest.approx(track_pair(*legs, StrideSettings()).distance_m, rel=0.03)
    assert not any(Flag.GAP in s.flags for s in found.strides)
    assert track_default(LegSamples(*columns), StrideSettings()).distance_m < 0.9 * found.distance_m


def test_sensors_that_are_not_worn_do_not_halve_the_way(legs: tuple[LegSamples, LegSamples]) -> None:
    first, nothing = legs[0], np.full(len(legs[0].t_s), np.nan)
    noise = 0.002 * np.random.default_rng(1).standard_normal((2, len(first.t_s)))
    lying = LegSamples(first.t_s, noise[0], noise[1], nothing, nothing)
    alone = track_default(first, StrideSettings()).distance_m
    for pair, name in (((first, lying), "the other"), ((lying, first), "the first")):
        found = track_pair(*pair, StrideSettings())
        assert found.distance_m == pytest.approx(alone, rel=0.03)
        assert any(f"the sensors of {name} leg rest" in note for note in found.notes)
        assert distance_sd_m(found.strides) > 0.07 * alone


def test_legs_of_two_persons_and_of_two_clocks(legs: tuple[LegSamples, LegSamples]) -> None:
    first, other = legs
    wide = replace(other, thigh=1.25 * other.thigh, shank=1.25 * other.shank)
    assert any("is a sensor loose?" in note for note in track_pair(first, wide, StrideSettings()).notes)
    with pytest.raises(EchostepError, match="no time in common"):
        track_pair(first, replace(other, t_s=other.t_s + 1000.0), StrideSettings())


def _write(path: Path, header: str, *columns: Floats) -> Path:
    np.savetxt(path, np.column_stack(columns), delimiter=",", header=header, comments="", fmt="%.6f")
    return path


def test_one_file_or_two(tmp_path: Path, legs: tuple[LegSamples, LegSamples]) -> None:
    first, other = legs
    header = ",".join(["t_s", *KEYS])
    left = _write(tmp_path / "left.csv", header + ",belt_rad_s", first.t_s, first.thigh, first.shank, first.belt)
    right = _write(tmp_path / "right.csv", header, other.t_s, other.thigh, other.shank)
    names = ",".join(["t_s", *(f"other_{key}" for key in KEYS), "belt_rad_s", *KEYS])
    one = _write(tmp_path / "one.csv", names, first.t_s, other.thigh, other.shank, first.belt, first.thigh, first.shank)
    pairs = [load_pair(paths) for paths in ([left, right], [one])]
    assert [len(pair) for pair in pairs] == [2, 2]
    tracks = [track_pair(pair[0], pair[1], StrideSettings()) for pair in pairs]
    assert tracks[0].distance_m == pytest.approx(tracks[1].distance_m, rel=0.002)
    assert len(load_pair([left])) == 1
    with pytest.raises(EchostepError, match="a person has two legs"):
        load_pair([left, right, one])
    broken = _write(
        tmp_path / "broken.csv", header + ",other_thigh_rad_s", first.t_s, first.thigh, first.shank, other.thigh
    )
    with pytest.raises(EchostepError, match="no column other_shank_rad_s"):
        load_pair([broken])
