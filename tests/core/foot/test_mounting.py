# SPDX-License-Identifier: MIT
"""Any mounting: the toe's direction is found from how the foot tips, and the track does not depend on it; soft limits of a gyro."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from echostep.arrays import Floats
from echostep.foot import soft_limit, stance
from echostep.foot.alignment import Alignment, aligned
from echostep.foot.steps import Foot, Step, Track, walk_track
from echostep.jit import lean_kernel
from echostep.ports.chunks import MTX, Chunk, portion_of
from echostep.tracker import Tracker
from echostep.xsens import MTDATA, MtxReader, encode_frame, pack_mtdata
from echostep_simulation.devices.board import PythonBoard
from echostep_simulation.scenario import Scenario
from foot import foot_walks as fw
from walks import PLAN, errors_of


def axis_mountings() -> list[Floats]:
    """The 24 rotations that bring axes onto axes."""
    found = []
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1.0, -1.0), repeat=3):
            turn = np.eye(3)[list(order)] * np.array(signs)[:, None]
            if np.linalg.det(turn) > 0.0:
                found.append(turn)
    return found


def walked(manner: str, mounting: Floats, steps: int = 10) -> Track:
    samples = fw.samples(fw.course(fw.MANNERS[manner], steps), 100, mounting, np.random.default_rng(1))
    return aligned(walk_track(*samples))


def off_rad(a: Floats | float, b: Floats | float) -> float:
    return float(np.abs(np.angle(np.exp(1j * (np.asarray(a) - np.asarray(b))))).max())


@pytest.mark.slow
def test_every_axis_mounting_and_random_ones_give_the_toes_direction() -> None:
    mountings = [*axis_mountings(), *(fw.any_rotation(np.random.default_rng(k)) for k in range(10))]
    assert len(mountings) == 34
    for mounting in mountings:
        track = walked("walking", mounting)
        assert track.toe_known
        assert off_rad(track.heading_rad, 0.0) < 0.1
        assert [step.move_m[0] for step in track.steps] == pytest.approx([1.3] * 10, abs=0.03)
        assert [step.move_m[1] for step in track.steps] == pytest.approx([0.0] * 10, abs=0.05)


@pytest.mark.slow
@pytest.mark.parametrize(
    "manner", ["backward", "sideways", "running", "upstairs", "downstairs", "turning", "strolling"]
)
def test_steps_in_any_direction_do_not_turn_the_toe(manner: str) -> None:
    """The first step as the toe sees it, in some mountings; backward steps go backward, sideways ones to the side."""
    true = fw.MANNERS[manner].move_m
    for k in range(4):
        track = walked(manner, fw.any_rotation(np.random.default_rng(k)), 20)
        assert track.toe_known
        first = np.array(track.steps[0].move_m[:2])
        assert off_rad(math.atan2(first[1], first[0]), math.atan2(true[1], true[0])) < 0.15


def test_live_the_first_steps_wait_for_the_toe_and_no_others() -> None:
    mounting = axis_mountings()[7]
    t, accel, gyro = fw.samples(fw.course(fw.MANNERS["walking"], 6), 100, mounting, np.random.default_rng(2))
    foot, alignment, waited, steps = Foot(), Alignment(), 0, []
    for k in range(len(t)):
        events = foot.feed(t[k : k + 1], accel[k : k + 1], gyro[k : k + 1])
        told = alignment.feed(events, float(t[k]))
        waited += bool(events) and not told and any(isinstance(e, Step) for e in events)
        steps += [e for e in told if isinstance(e, Step)]
    assert waited <= 2
    assert len(steps) == 6
    assert np.array([s.move_m[:2] for s in steps]) == pytest.approx(np.tile([1.3, 0.0], (6, 1)), abs=0.15)


@pytest.fixture(scope="module")
def live() -> tuple[Scenario, list[Chunk]]:
    """A simulated walk, x of the MTx to the toe."""
    scenario = Scenario(PLAN, ((2.0, 7.5), (9.5, 7.5), (9.5, 10.8), (9.5, 7.5), (18.0, 7.5)), 5, PythonBoard(5))
    return scenario, list(scenario.chunks())


@pytest.mark.slow
@pytest.mark.parametrize("which", [0, 5, 11, 18, 22])
def test_live_the_mtx_may_sit_in_any_way(live: tuple[Scenario, list[Chunk]], which: int) -> None:
    """The same bytes with the sensor's axes turned: as good a track."""
    scenario, chunks = live
    mounting = axis_mountings()[which]
    frames, turned = MtxReader(), []
    for chunk in chunks:
        if chunk.port == MTX:
            samples = [
                s._replace(accel=tuple((mounting @ s.accel).tolist()), gyro=tuple((mounting @ s.gyro).tolist()))
                for s in frames.feed(chunk.data)
            ]
            chunk = replace(chunk, data=b"".join(encode_frame(MTDATA, pack_mtdata(s)) for s in samples))
        turned.append(chunk)
    found = Tracker(PLAN, scenario.start, seed=0).take(portion_of(turned))
    off = errors_of(found, scenario)
    assert off.horizontal_m.mean() < 0.2
    assert off.horizontal_m.max() < 0.8
    assert off.in_ellipse95 > 0.8


def test_a_foot_that_does_not_tip_is_taken_to_have_x_to_the_toe_until_it_tips() -> None:
    alignment = Alignment()
    step = Step(0.0, 1.0, (0.2, 0.1, 0.0), np.eye(3), 0.0, 0.01)
    assert alignment.feed([step, step], 1.0) == []
    assert alignment.waiting
    assert [event.move_m for event in alignment.feed([step], 1.0) if isinstance(event, Step)] == [step.move_m] * 3
    assert len(alignment.feed([step], 2.0)) == 1
    (tipped,) = alignment.feed([replace(step, toe_rad=math.pi / 2)], 3.0)
    assert isinstance(tipped, Step)
    assert tipped.move_m == pytest.approx((0.1, -0.2, 0.0))
    assert not alignment.waiting


def test_nobody_who_stops_after_one_step_is_kept_waiting() -> None:
    alignment = Alignment()
    step = Step(0.0, 1.0, (0.2, 0.1, 0.0), np.eye(3), 0.0, 0.01)
    assert alignment.feed([step], 1.0) == []
    assert alignment.feed([], 3.0) == []
    assert alignment.feed([], 6.0) == [step]


QUICK_LAPS = fw.FootManner((1.2, 0.0, 0.0), turn_rad=0.35, swing_s=0.55, stance_s=0.22, toe_off_rad=1.0, roll_s=0.09)
STEPS = 40


@pytest.mark.parametrize("rate_hz", [100, 200])
@pytest.mark.parametrize("name", ["quick laps", "walking"])
def test_a_soft_limit_costs_a_percent_and_no_step(name: str, rate_hz: int) -> None:
    """At 80 % of the greatest rate; without the correction steps are missed, or the track leaves by tens of percent."""
    manner = QUICK_LAPS if name == "quick laps" else fw.MANNERS["walking"]
    course = fw.course(manner, STEPS)
    t, accel, gyro = fw.samples(course, rate_hz, rng=np.random.default_rng(1))
    track = walk_track(t, accel, fw.bent(gyro, 0.8 * float(np.abs(gyro).max())))
    assert len(track.steps) == STEPS
    assert track.counts.saturated > 5 * STEPS
    way = sum(float(np.hypot(*step.move_m[:2])) for step in track.steps)
    assert way == pytest.approx(float(np.hypot(*np.diff(course.prints_m, axis=0)[:, :2].T).sum()), rel=0.01)
    error = (track.steps[-1].heading_rad - STEPS * manner.turn_rad + np.pi) % (2.0 * np.pi) - np.pi
    assert abs(error) < np.radians(8.0)


def test_a_rate_at_the_value_of_the_last_plateau_may_be_rounder() -> None:
    window = stance.new_window()
    for k, rate in enumerate((8.9, 9.01)):  # 2.4 per second: more than 2, less than 3
        stance.add_sample(window, 0.005 * k, np.zeros(3), np.full(3, rate))
    flat: Callable[..., bool] = lean_kernel(lambda window, limit: soft_limit._flat(window, 0, 0, 1, limit))
    assert [flat(window, limit) for limit in (0.0, 8.95, 9.2)] == [False, True, False]


@pytest.mark.parametrize("name", ["walking", "running", "turning", "downstairs"])
def test_a_round_peak_is_no_limit(name: str) -> None:
    t, accel, gyro = fw.samples(fw.course(fw.MANNERS[name], 10), 200, rng=np.random.default_rng(2))
    assert walk_track(t, accel, gyro).counts.saturated == 0
