# SPDX-License-Identifier: MIT
"""Foot and belt headings together: less drift than the foot's, honestly stated; a belt gyro that cannot be trusted changes nothing."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import astuple, dataclass, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from echostep.arrays import Floats
from echostep.elementary import wrap
from echostep.foot.steps import Stance, Step
from echostep.legs.trunk_path import GyroBlock
from echostep.odometry.heading_fusion import HeadingFusion
from echostep.path import MeasuredSegment, PathSegment

STRIDE_S, STANCE_S, STRIDE_M, RATE_HZ = 1.1, 0.5, 1.3, 200
DRIFT_RAD = math.radians(0.6)  # of the foot's yaw, a stride
JITTER_RAD = math.radians(1.0)  # of the trunk against the foot
BIAS_RAD_S = math.radians(1.5)
NOISE_RAD_S = math.radians(0.5)
OF_USERS_RAD = math.radians(0.3)  # per root metre: what particles and maps add to what a segment states
STRIDES = 450  # eight minutes
WALKS = 8
LEARNT = 150  # strides after which the bias is known
Change = Callable[[Floats, Floats], Floats]  # times and rates of the belt -> what its gyro reads


@dataclass
class Walker:
    """A walk with a right angle every 12 strides: the true heading after each stride, and the foot's drift."""

    seed: int
    strides: int = STRIDES
    aside_rad: float = 0.0  # the trunk looks aside in every 40th stance

    def __post_init__(self) -> None:
        rng = np.random.default_rng(self.seed)
        turns = np.where(np.arange(self.strides) % 12 == 5, rng.choice([-1.0, 1.0], self.strides) * 0.5 * math.pi, 0.0)
        self.heading = np.cumsum(turns)
        self.drift = np.cumsum(DRIFT_RAD * rng.standard_normal(self.strides))
        self.offset = JITTER_RAD * rng.standard_normal(self.strides)
        self.offset[39::40] += self.aside_rad
        self.rng = rng

    @property
    def stances_s(self) -> Floats:
        """Middles of the stances."""
        return 1.0 + STRIDE_S * np.arange(1.0, self.strides + 1.0)

    def events(self) -> list[Step | Stance]:
        """Of the foot, whose walk frame turns by its drift."""
        found: list[Step | Stance] = []
        before = 0.0
        for t, heading, drift in zip(self.stances_s.tolist(), self.heading, self.drift, strict=True):
            yaw, way = wrap(heading + drift), 0.5 * (before + heading + drift)
            move = (STRIDE_M * math.cos(way), STRIDE_M * math.sin(way), 0.0)
            start, end = t - 0.5 * STANCE_S, t + 0.5 * STANCE_S
            found.append(Step(start - STRIDE_S + STANCE_S, start, move, np.eye(3) * 1e-4, yaw, DRIFT_RAD))
            found.append(Stance(start, end, yaw))
            before = heading + drift
        return found

    def belt(self) -> tuple[Floats, Floats]:
        """Times and rates of the belt's gyro."""
        t_s = np.arange(0.0, self.stances_s[-1] + 2.0, 1.0 / RATE_HZ)
        angle = np.interp(t_s, self.stances_s, self.heading + self.offset)
        noise = NOISE_RAD_S * self.rng.standard_normal(len(t_s))
        return t_s, np.gradient(angle) * RATE_HZ + BIAS_RAD_S + noise


def blocks(t_s: Floats, rate: Floats) -> Iterator[GyroBlock]:
    none = np.zeros(20)
    for k in range(0, len(t_s) - 19, 20):
        yield GyroBlock(t_s[k : k + 20], none, none, rate[k : k + 20], none)


def fused(fusion: HeadingFusion, coming: Iterator[GyroBlock], events: Iterable[Step | Stance]) -> Iterator[Step]:
    """The steps with the belt's help: each event comes 0.15 s after its end, each block at its last sample."""
    block = next(coming, None)
    for event in events:
        while block is not None and not block.t_s[-1] > event.t_end_s + 0.15:
            fusion.add_belt(block)
            block = next(coming, None)
        found = fusion.corrected(event)
        if isinstance(found, Step):
            yield found


def walked(
    walker: Walker, change: Change = lambda _, rate: rate, at_s: Floats | None = None, first: Stance | None = None
) -> tuple[HeadingFusion, list[Step]]:
    """The steps with the belt's help, and what gave it."""
    fusion = HeadingFusion()
    t_s, rate = walker.belt()
    coming = blocks(t_s if at_s is None else at_s, change(t_s, rate))
    return fusion, list(fused(fusion, coming, [*([first] if first else []), *walker.events()]))


def errors(walker: Walker, steps: list[Step]) -> Floats:
    """Of the headings (n,), not wrapped."""
    return np.unwrap(np.array([step.heading_rad for step in steps]) - walker.heading)


def growth(error: Floats, strides: int) -> float:
    """Mean square growth of an error over so many strides."""
    return float(np.mean((error[strides:] - error[:-strides]) ** 2))


def foot_alone(walker: Walker) -> list[Step]:
    return [event for event in walker.events() if isinstance(event, Step)]


def told(events: Iterable[Step | Stance]) -> list[tuple[object, ...]]:
    """Events as tuples, every bit of them."""
    return [
        (e,)
        if isinstance(e, Stance)
        else (
            *astuple(replace(e, covariance=np.zeros(0)))[:3],
            e.covariance.tobytes(),
            e.heading_rad,
            e.heading_sd_rad,
            e.toe_rad,
        )
        for e in events
    ]


def segments_of(walker: Walker, change: Change = lambda _, rate: rate) -> list[MeasuredSegment]:
    """The walk's segments as the front end makes them, from the middle of one stance to that of the next."""
    fusion, found, before = HeadingFusion(), list[MeasuredSegment](), 0.0
    t_s, rate = walker.belt()
    for step in fused(fusion, blocks(t_s, change(t_s, rate)), walker.events()):
        t1 = step.t_end_s + 0.25
        segment = PathSegment(
            t1 - STRIDE_S, t1, step.move_m[0], step.move_m[1], before, step.heading_rad, 0.02, step.heading_sd_rad,
            len(found), belt=fusion.evidence,
        )  # fmt: skip
        found.append(MeasuredSegment(segment, np.zeros(0), np.zeros(0, np.int64), np.zeros(0)))
        before = step.heading_rad
    return found


@pytest.mark.slow
def test_the_drift_over_a_minute_is_much_less_and_no_more_than_particles_allow() -> None:
    foot, fused, stated = 0.0, 0.0, 0.0
    for seed in range(WALKS):
        walker = Walker(seed)
        fusion, steps = walked(walker)
        assert fusion.trusted
        foot += growth(walker.drift[LEARNT:], 55)
        fused += growth(errors(walker, steps)[LEARNT:], 55)
        variance = np.array([step.heading_sd_rad**2 for step in steps])[LEARNT:]
        stated += 55.0 * float(variance.mean())
    # The bias, known to 0.57 degrees per root second of walking over the root of 165 to 500 s, makes 2.1 degrees of drift in a minute, the fading as
    # much again; the foot 4.7.
    assert math.sqrt(fused / foot) < 0.75
    assert stated < fused < stated + 1.5 * WALKS * 55.0 * STRIDE_M * OF_USERS_RAD**2


def test_moves_turn_with_the_headings_and_keep_their_lengths() -> None:
    walker = Walker(3)
    fusion, steps = walked(walker)
    assert fusion.correction_rad != 0.0
    for step, before in zip(steps, foot_alone(walker), strict=True):
        turned = wrap(step.heading_rad - before.heading_rad)
        moved = math.atan2(step.move_m[1], step.move_m[0]) - math.atan2(before.move_m[1], before.move_m[0])
        assert wrap(moved - turned) == pytest.approx(0.0, abs=1e-9)
        assert math.hypot(*step.move_m) == pytest.approx(STRIDE_M)
        assert (step.toe_rad, step.t_end_s) == (before.toe_rad, before.t_end_s)


def missing(t_s: Floats, _rate: Floats) -> Floats:
    return np.full(len(t_s), np.nan)


def dead(t_s: Floats, _rate: Floats) -> Floats:
    return np.full(len(t_s), 0.01)


def numb(t_s: Floats, _rate: Floats) -> Floats:
    """Noise alone: of a gyro that lies on a table, or whose axis is level."""
    return BIAS_RAD_S + NOISE_RAD_S * np.random.default_rng(1).standard_normal(len(t_s))


def upside_down(_t_s: Floats, rate: Floats) -> Floats:
    return -rate


def half(_t_s: Floats, rate: Floats) -> Floats:
    """Of a belt tilted by 60 degrees."""
    return 0.5 * rate


def swinging(t_s: Floats, rate: Floats) -> Floats:
    """On a bag that swings by 20 degrees about the wearer."""
    return rate + math.radians(20.0) * 2.0 * np.cos(2.0 * t_s)


def frantic(t_s: Floats, _rate: Floats) -> Floats:
    return np.random.default_rng(2).standard_normal(len(t_s)) * 20.0


@pytest.mark.parametrize("change", [missing, dead, numb, upside_down, half, frantic])
def test_a_belt_that_does_not_turn_with_the_foot_changes_nothing(change: Change) -> None:
    walker = Walker(1)
    fusion, steps = walked(walker, change)
    assert fusion.correction_rad == 0.0
    assert told(steps) == told(foot_alone(walker))


def test_a_belt_that_swings_hardly_corrects() -> None:
    walker = Walker(1)
    _, steps = walked(walker, swinging)
    corrections = [wrap(f.heading_rad - s.heading_rad) for s, f in zip(steps, foot_alone(walker), strict=True)]
    assert np.abs(corrections).max() < math.radians(4.0)


def test_standing_tells_the_bias() -> None:
    """A stance of 20 s, then straight on: the correction is worth something after the first turns, much earlier than without."""
    stated = []
    for stands_s in (0.0, 20.0):
        walker = Walker(2, 60)
        t_s, rate = walker.belt()
        standing_s = np.arange(0.0, stands_s, 1.0 / RATE_HZ) - stands_s
        noise = NOISE_RAD_S * np.random.default_rng(9).standard_normal(len(standing_s))
        read = np.append(BIAS_RAD_S + noise, rate)
        first = Stance(-stands_s, 1.35, 0.0)
        _, steps = walked(walker, lambda *_, read=read: read, np.append(standing_s, t_s), first)
        stated.append(steps[-1].heading_sd_rad)
    assert stated[1] < 0.9 * stated[0]


def test_without_a_board_nothing_changes() -> None:
    fusion, walker = HeadingFusion(), Walker(1, 50)
    assert told(fusion.corrected(event) for event in walker.events()) == told(walker.events())


@pytest.mark.parametrize("change", [missing, dead, numb])
def test_a_belt_that_fails_on_the_way_leaves_the_foot_alone(change: Change) -> None:
    walker, fails_s = Walker(4), 300.0
    t_s, rate = walker.belt()
    failed = np.where(t_s < fails_s, rate, change(t_s, rate))
    _, steps = walked(walker, lambda *_: failed)
    turned = np.unwrap([s.heading_rad - f.heading_rad for s, f in zip(steps, foot_alone(walker), strict=True)])
    after = np.array([step.t_end_s for step in steps]) > fails_s
    # Until the next turn (twelve strides) a numb gyro looks like one of a straight way.
    assert np.ptp(turned[after]) < math.radians(4.0)
    late = np.array([step.t_end_s for step in steps]) > fails_s + 30.0
    assert np.ptp(turned[late]) < 1e-9
    assert {step.heading_sd_rad for step, x in zip(steps, late, strict=True) if x} == {DRIFT_RAD}


def test_what_was_left_unstated_is_stated_when_the_belt_fails() -> None:
    walker = Walker(4)
    t_s, rate = walker.belt()
    failed = np.where(t_s < 300.0, rate, np.nan)
    _, steps = walked(walker, lambda *_: failed)
    of_failure = [step.heading_sd_rad for step in steps if 300.0 < step.t_end_s < 300.0 + 3.0 * STRIDE_S]
    assert max(of_failure) > 1.2 * DRIFT_RAD


@pytest.mark.slow
def test_the_foots_own_heading_returns_in_the_long_run() -> None:
    """With a known bias alone the fused heading would drift by the root of two of the foot's."""
    end = [(walker.drift[-1], errors(walker, walked(walker)[1])[-1]) for walker in map(Walker, range(WALKS))]
    foot, fused = np.sqrt(np.mean(np.square(end), axis=0))
    assert fused < 1.25 * foot


def test_a_belt_that_comes_back_is_trusted_again_after_turns() -> None:
    walker = Walker(5)
    t_s, rate = walker.belt()
    failed = np.where((t_s < 200.0) | (t_s > 230.0), rate, np.nan)
    fusion, steps = walked(walker, lambda *_: failed)
    assert min(step.heading_sd_rad for step in steps if 233.0 < step.t_end_s < 250.0) > 0.85 * DRIFT_RAD
    assert fusion.trusted
    assert growth(errors(walker, steps)[-120:], 30) < growth(walker.drift[-120:], 30)


def test_looking_aside_for_a_stance_costs_less_than_a_stride() -> None:
    straight, aside = (walked(Walker(6, aside_rad=math.radians(a)))[0] for a in (0.0, 60.0))
    assert aside.trusted
    assert abs(wrap(straight.correction_rad - aside.correction_rad)) < 4.0 * DRIFT_RAD


def test_a_turn_of_the_trunk_that_lasts_begins_anew() -> None:
    walker = Walker(7)
    walker.offset[300:] += math.radians(40.0)
    _, steps = walked(walker)
    assert min(step.heading_sd_rad for step in steps[303:312]) > 0.9 * DRIFT_RAD
    error = errors(walker, steps)
    assert abs(error[310] - error[298]) < 8.0 * DRIFT_RAD


def test_a_foot_that_lost_its_heading_is_not_turned_back() -> None:
    """Its walk frame is another one then, which the legs or the plan join to the first."""
    walker, fusion = Walker(8), HeadingFusion()
    coming, corrections = blocks(*walker.belt()), []
    for k, event in enumerate(walker.events()):
        for block in coming:
            fusion.add_belt(block)
            if block.t_s[-1] > event.t_end_s:
                break
        lost = 2.0 if k >= 600 else 0.0
        sd = 1.0 if k == 600 else DRIFT_RAD
        fusion.corrected(
            replace(event, heading_rad=wrap(event.heading_rad + lost))
            if isinstance(event, Stance)
            else replace(event, heading_rad=wrap(event.heading_rad + lost), heading_sd_rad=sd)
        )
        corrections.append(fusion.correction_rad)
    assert abs(corrections[590]) > 0.0
    assert np.ptp(corrections[601:606]) == 0.0
    assert np.ptp(corrections[596:700]) < 20.0 * DRIFT_RAD


@pytest.mark.slow
@given(
    st.integers(0, 2**32 - 1),
    st.lists(st.integers(0, 30_000), max_size=6),
    st.sampled_from([np.nan, np.inf, 0.0, 40.0]),
)
@settings(max_examples=30, deadline=None)
def test_any_damage_gives_finite_steps(seed: int, places: list[int], value: float) -> None:
    walker = Walker(seed, 100)
    t_s, rate = walker.belt()
    for place in places:
        rate[place % len(rate) : place % len(rate) + 50] = value
        t_s[(7 * place) % len(t_s)] = value
    _, steps = walked(walker, lambda *_: rate)
    for step in steps:
        assert math.isfinite(step.heading_rad)
        assert 0.0 <= step.heading_sd_rad < 1.0
        assert math.hypot(*step.move_m) == pytest.approx(STRIDE_M)
