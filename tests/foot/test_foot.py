"""The foot: kernels against textbook twins, walks whose truth is known, hostile samples, real recordings."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import foot_walks as fw
from echostep.arrays import Floats
from echostep.foot import ins
from echostep.foot.steps import Foot, FootSettings, Stance, Step, Track, walk_track

Samples = tuple[Floats, Floats, Floats]

LATENCY_S = 0.05


def moves(track: Track) -> Floats:
    return np.array([step.move_m for step in track.steps])


def same(a: list[Step | Stance], b: list[Step | Stance]) -> bool:
    """Whether two lists of events are equal in every bit."""
    return [repr(event) for event in a] == [repr(event) for event in b]


def walking(steps: int = 5, rate_hz: int = 100, seed: int = 1) -> Samples:
    return fw.samples(fw.course(fw.MANNERS["walking"], steps), rate_hz, rng=np.random.default_rng(seed))


# Kernels against slow, obviously right twins.


def some_nav(rng: np.random.Generator) -> ins.Nav:
    nav = ins.new_nav(ins.Noise())
    for part in (nav.position, nav.velocity, nav.gyro_bias, nav.accel_bias):
        part[:] = rng.standard_normal(3)
    nav.attitude[:] = rng.standard_normal(4)
    nav.attitude[:] /= np.linalg.norm(nav.attitude)
    root = rng.standard_normal((ins.SIZE, ins.SIZE))
    nav.P[:] = root @ root.T
    return nav


def copied(nav: ins.Nav) -> ins.Nav:
    parts = nav._asdict()
    return ins.Nav(**{name: part if name == "noise" else part.copy() for name, part in parts.items()})


def cross(v: Floats) -> Floats:
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def expm(m: Floats) -> Floats:
    """Matrix exponential by its series."""
    total = term = np.eye(len(m))
    for k in range(1, 30):
        term = term @ m / k
        total = total + term
    return total


def apply_errors(nav: ins.Nav, errors: Floats) -> ins.Nav:
    """The state with errors (16,) put in."""
    rotation = expm(cross(errors[ins.TILT : ins.TILT + 3])) @ ins.rotation(nav.attitude)
    moved = copied(nav)
    moved.position[:] += errors[ins.POS : ins.POS + 3]
    moved.velocity[:] += errors[ins.VEL : ins.VEL + 3]
    moved.gyro_bias[:] += errors[ins.GYRO_BIAS : ins.GYRO_BIAS + 3]
    moved.accel_bias[:] += errors[ins.ACCEL_BIAS : ins.ACCEL_BIAS + 3]
    moved.attitude[:] = quaternion(rotation)
    return moved


def quaternion(r: Floats) -> Floats:
    """Unit quaternion of a rotation matrix, by its eigenvector."""
    k = np.array(
        [
            [r[0, 0] + r[1, 1] + r[2, 2], r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]],
            [r[2, 1] - r[1, 2], r[0, 0] - r[1, 1] - r[2, 2], r[0, 1] + r[1, 0], r[0, 2] + r[2, 0]],
            [r[0, 2] - r[2, 0], r[0, 1] + r[1, 0], r[1, 1] - r[0, 0] - r[2, 2], r[1, 2] + r[2, 1]],
            [r[1, 0] - r[0, 1], r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], r[2, 2] - r[0, 0] - r[1, 1]],
        ]
    )
    return np.asarray(np.linalg.eigh(k)[1][:, -1])


def errors_between(a: ins.Nav, b: ins.Nav) -> Floats:
    """Errors (15,) of a against b, small angles."""
    turn = np.array(ins.rotation(b.attitude)) @ np.array(ins.rotation(a.attitude)).T
    angle = 0.5 * np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    parts = (
        b.position - a.position,
        b.velocity - a.velocity,
        angle,
        b.gyro_bias - a.gyro_bias,
        b.accel_bias - a.accel_bias,
    )
    return np.concatenate(parts)


def test_strapdown_follows_a_turning_and_accelerating_body_exactly() -> None:
    """A constant turn about a skew axis and a constant acceleration in the walk frame, integrated in closed form."""
    rate, accel, dt, n = np.array([0.7, -1.1, 2.0]), np.array([0.4, -0.2, 0.3]), 0.002, 1000
    nav = ins.new_nav(ins.Noise())
    forces = [expm(cross(rate) * (k - 0.5) * dt).T @ (accel + [0.0, 0.0, ins.GRAVITY_M_S2]) for k in range(n + 1)]
    for k in range(n):
        ins.propagate(nav, dt, dt, forces[k], forces[k + 1], rate, rate)
    t = n * dt
    assert np.array(ins.rotation(nav.attitude)) == pytest.approx(expm(cross(rate) * t), abs=1e-9)
    assert nav.velocity == pytest.approx(accel * t, abs=1e-4)
    assert nav.position == pytest.approx(0.5 * accel * t * t, abs=1e-4)


def test_attitude_is_right_to_second_order_when_the_axis_turns() -> None:
    """Coning: the rate's axis goes round; a fine integration is the truth."""

    def rate(t: float) -> Floats:
        return np.array([3.0 * math.cos(20.0 * t), 3.0 * math.sin(20.0 * t), 0.5])

    def integrate(dt: float, n: int) -> Floats:
        nav, force = ins.new_nav(ins.Noise()), np.zeros(3)
        for k in range(n):
            ins.propagate(nav, dt, dt, force, force, rate((k - 0.5) * dt), rate((k + 0.5) * dt))
        return np.array(ins.rotation(nav.attitude))

    fine, coarse = integrate(1e-4, 10_000), integrate(0.01, 100)
    assert np.abs(coarse - fine).max() < 0.003


def test_transition_is_the_derivative_of_the_strapdown_step() -> None:
    rng = np.random.default_rng(3)
    nav = some_nav(rng)
    dt, forces, rates = 0.01, rng.standard_normal((2, 3)) + [0.0, 0.0, 9.8], rng.standard_normal((2, 3))

    def after(errors: Floats) -> ins.Nav:
        moved = apply_errors(nav, errors)
        ins.propagate(moved, dt, dt, forces[0], forces[1], rates[0], rates[1])
        return moved

    here, eps = after(np.zeros(15)), 1e-6
    transition = np.stack([errors_between(here, after(eps * e)) / eps for e in np.eye(15)], axis=1)
    for at in range(15):  # one column of F at a time, by a covariance that holds just that error
        single = copied(nav)
        single.P[:] = 0.0
        single.P[at, at] = 1e8
        ins.propagate(single, dt, dt, forces[0], forces[1], rates[0], rates[1])
        column = single.P[:15, at] / 1e8 / transition[at, at]
        assert column == pytest.approx(transition[:, at], abs=2e-3)


def test_update_agrees_with_the_textbook() -> None:
    rng = np.random.default_rng(4)
    for at in range(ins.SIZE):
        nav = some_nav(rng)
        before = copied(nav)
        error, variance = 1e-3 * float(rng.standard_normal()), 0.3
        ins.update(nav, at, error, variance)
        h = np.eye(ins.SIZE)[at : at + 1]
        gain = before.P @ h.T / (h @ before.P @ h.T + variance)
        joseph = np.eye(ins.SIZE) - gain @ h
        assert pytest.approx(joseph @ before.P @ joseph.T + variance * gain @ gain.T, abs=1e-9) == nav.P
        assert errors_between(before, nav) == pytest.approx((gain * error)[:15, 0], rel=1e-4, abs=1e-9)


def test_covariance_stays_symmetric_and_positive() -> None:
    foot = Foot()
    foot.feed(*walking(40, 200))
    P = foot._nav.P
    scale = np.sqrt(np.diag(P)) + 1e-12
    assert np.abs(P - P.T).max() <= 1e-9 * scale.max() ** 2
    assert np.linalg.eigvalsh(P / np.outer(scale, scale)).min() > -1e-6


# Walks whose truth is known: one setting for every manner, rate and mounting.


@pytest.mark.parametrize("rate_hz", [50, 100, 200, 500])
@pytest.mark.parametrize("manner", list(fw.MANNERS))
def test_every_manner_of_walking_at_every_rate(manner: str, rate_hz: int) -> None:
    course = fw.course(fw.MANNERS[manner], 10)
    track = walk_track(*fw.samples(course, rate_hz, rng=np.random.default_rng(rate_hz)))
    true = np.diff(course.prints_m, axis=0)
    assert len(track.steps) == 10
    off = np.hypot(*moves(track)[:, :2].T) - np.hypot(*true[:, :2].T)
    said = np.sqrt([np.linalg.eigvalsh(step.covariance[:2, :2])[-1] for step in track.steps])
    assert abs(off.mean()) < 0.01 * np.hypot(*true[0, :2]) + 0.01
    assert (np.abs(off) < 3.0 * said).all()
    assert moves(track)[:, 2] == pytest.approx(true[:, 2], abs=0.04)
    assert track.position_m[-1, 2] == pytest.approx(course.prints_m[-1, 2], abs=0.1)
    turned = track.heading_rad[-1] - 10 * fw.MANNERS[manner].turn_rad
    assert abs(math.remainder(turned, 2 * math.pi)) < 0.05
    assert track.counts.forced == 0


def test_steps_end_with_the_landing_and_are_told_at_once() -> None:
    course = fw.course(fw.MANNERS["walking"], 10)
    t, accel, gyro = fw.samples(course, 100, rng=np.random.default_rng(5))
    foot, steps = Foot(), []
    for k in range(len(t)):
        for event in foot.feed(t[k : k + 1], accel[k : k + 1], gyro[k : k + 1]):
            if isinstance(event, Step):
                steps.append(event)
                assert foot.in_stance
                assert t[k] - event.t_end_s <= LATENCY_S
    assert [step.t_end_s for step in steps] == pytest.approx(course.landed_s.tolist(), abs=0.06)
    assert [step.t_start_s for step in steps] == pytest.approx(course.left_s.tolist(), abs=0.12)


def test_stances_and_steps_alternate_and_moves_add_up_to_the_position() -> None:
    track = walk_track(*walking(10))
    for before, after in zip(track.events, track.events[1:], strict=False):
        assert isinstance(before, Step) != isinstance(after, Step)
        assert before.t_end_s <= after.t_start_s or isinstance(after, Stance)
    last = track.steps[-1]
    told = int(np.searchsorted(track.t_s, last.t_end_s + LATENCY_S))
    assert moves(track).sum(0) == pytest.approx(track.position_m[told], abs=0.01)
    assert track.stance[told]


def test_mounting_does_not_matter() -> None:
    course = fw.course(fw.MANNERS["turning"], 8)
    t, accel, gyro = fw.samples(course, 100)
    plain = walk_track(t, accel, gyro)
    for seed in range(5):
        mounting = fw.any_rotation(np.random.default_rng(seed))
        turned = walk_track(t, accel @ mounting.T, gyro @ mounting.T)
        lengths = np.hypot(*moves(turned)[:, :2].T)
        assert lengths == pytest.approx(np.hypot(*moves(plain)[:, :2].T), abs=1e-5)
        assert turned.heading_rad[-1] == pytest.approx(plain.heading_rad[-1], abs=1e-5)


def test_height_of_the_sensor_is_what_it_says() -> None:
    """A foot that rolls slowly under a sensor 15 cm up: told so, steps are right; told 0, every step is short."""
    manner = fw.Manner(height_m=0.15, stance_s=0.9, roll_s=0.4, toe_off_rad=0.6)
    course = fw.course(manner, 10)
    samples = fw.samples(course, 200)
    off = {h: float(np.hypot(*moves(walk_track(*samples, FootSettings(h)))[:, :2].T).mean()) - 1.3 for h in (0.0, 0.15)}
    assert abs(off[0.15]) < 0.005
    assert off[0.0] < -0.01


def test_errors_are_no_larger_than_said() -> None:
    """Over many walks with an MTx's noise and biases: moves within their covariance, headings within their growth."""
    course = fw.course(fw.MANNERS["walking"], 8)
    nees, heading = [], []
    for seed in range(30):
        track = walk_track(*fw.samples(course, 100, rng=np.random.default_rng([6, seed])))
        assert len(track.steps) == 8
        for step, true in zip(track.steps, np.diff(course.prints_m, axis=0), strict=True):
            along = np.array([math.cos(step.heading_rad), math.sin(step.heading_rad), 0.0])
            off = float(np.hypot(*step.move_m[:2]) - np.hypot(*true[:2]))
            nees.append(off**2 / float(along @ step.covariance @ along))
        total = math.sqrt(sum(step.heading_sd_rad**2 for step in track.steps))
        heading.append(track.heading_rad[-1] / total)
    assert np.mean(nees) < 1.0
    assert 0.2 < np.sqrt(np.mean(np.square(heading))) < 1.5


def test_standing_for_ten_minutes_stays_there() -> None:
    rng = np.random.default_rng(7)
    t = np.arange(60_000) / 100.0
    accel = np.array([1.0, -2.0, 9.55]) + 0.02 * rng.standard_normal((len(t), 3))
    gyro = np.array([0.01, -0.02, 0.015]) + 0.0087 * rng.standard_normal((len(t), 3))
    track = walk_track(t, accel, gyro)
    assert track.events == []
    assert track.stance[100:].all()
    assert np.abs(track.position_m).max() < 0.02
    assert abs(track.heading_rad[-1]) < 0.06


# The same bits, however the samples come.


@settings(max_examples=20)
@given(cuts=st.lists(st.integers(0, 900), max_size=30), seed=st.integers(0, 3))
def test_any_portions_give_the_same_bits(cuts: list[int], seed: int) -> None:
    t, accel, gyro = walking(3, seed=seed)
    edges = [0, *sorted(min(cut, len(t)) for cut in cuts), len(t)]
    foot = Foot()
    events = [e for a, b in zip(edges, edges[1:], strict=False) for e in foot.feed(t[a:b], accel[a:b], gyro[a:b])]
    whole = walk_track(t, accel, gyro)
    assert same(events, whole.events)
    assert foot.position_m == tuple(whole.position_m[-1])
    assert foot.heading_rad == whole.heading_rad[-1]
    assert foot.in_stance == whole.stance[-1]
    assert foot.counts == whole.counts


# Hostile samples.


def test_a_fifth_of_the_samples_may_be_missing() -> None:
    course = fw.course(fw.MANNERS["walking"], 10)
    t, accel, gyro = fw.samples(course, 100, rng=np.random.default_rng(8))
    kept = np.random.default_rng(9).random(len(t)) > 0.2
    track = walk_track(t[kept], accel[kept], gyro[kept])
    assert len(track.steps) == 10
    assert np.hypot(*moves(track)[:, :2].T) == pytest.approx(np.full(10, 1.3), abs=0.15)
    assert track.counts.gaps == 0


def test_duplicates_and_nonsense_are_counted_and_change_nothing() -> None:
    t, accel, gyro = walking()
    at = np.random.default_rng(10).choice(np.arange(1, len(t)), 90, replace=False)
    nonsense = np.array([np.nan, np.inf, 1e9])[np.arange(30) % 3]
    bad_accel, bad_gyro, bad_t = (np.repeat(v[at], 1, axis=0).copy() for v in (accel, gyro, t))
    bad_accel[:30, 0], bad_gyro[30:60, 2], bad_t[60:] = nonsense, -nonsense, t[at[60:] - 1]
    order = np.argsort(np.concatenate([np.arange(len(t)), at - 0.5]), kind="stable")
    mixed = [np.concatenate([a, b])[order] for a, b in ((t, bad_t), (accel, bad_accel), (gyro, bad_gyro))]
    track, plain = walk_track(mixed[0], mixed[1], mixed[2]), walk_track(t, accel, gyro)
    assert same(track.events, plain.events)
    assert (track.counts.impossible, track.counts.not_later) == (60, 30)
    assert track.counts.samples == len(t)


@pytest.mark.parametrize("gap_s", [0.4, 3.0, 100.0])
def test_a_gap_makes_it_unsure_and_it_recovers(gap_s: float) -> None:
    t, accel, gyro = walking(12)
    landing = 2.0 + 3 * 1.1 + 0.3  # in the middle of the fourth swing
    kept = (t < landing) | (t > landing + 1.1 * 2)
    t = np.where(t > landing, t + gap_s - 2.2, t)
    track = walk_track(t[kept], accel[kept], gyro[kept])
    across = [step for step in track.steps if step.t_start_s < landing < step.t_end_s]
    assert track.counts.gaps == 1
    assert len(across) == 1
    assert across[0].covariance[0, 0] >= (0.5 * gap_s) ** 2
    assert across[0].covariance[2, 2] >= (0.5 * gap_s) ** 2
    assert across[0].heading_sd_rad > 0.3
    after = [step for step in track.steps if step.t_start_s >= across[0].t_end_s]
    assert len(after) == 6
    assert np.hypot(*np.array([step.move_m for step in after])[:, :2].T) == pytest.approx(np.full(6, 1.3), abs=0.03)
    assert max(step.covariance[0, 0] for step in after) < 0.05


def test_a_clock_that_is_set_back_is_followed() -> None:
    t, accel, gyro = walking(10)
    t = np.where(t > 6.0, t - 5.5, t)
    track = walk_track(t, accel, gyro)
    assert track.counts.gaps == 1
    assert 0 < track.counts.not_later < 30
    assert len(track.steps) >= 8


def test_one_stamp_from_the_far_future_costs_a_few_samples_only() -> None:
    t, accel, gyro = walking(10)
    t[400] = 1e9
    track = walk_track(t, accel, gyro)
    assert track.counts.not_later < 30
    assert len(track.steps) >= 8


def test_clipped_gyros_are_noticed_and_trusted_less() -> None:
    t, accel, gyro = walking(10)
    limit = 0.8 * float(np.abs(gyro).max())
    track = walk_track(t, accel, np.clip(gyro, -limit, limit))
    plain = walk_track(t, accel, gyro)
    assert plain.counts.saturated == 0
    assert track.counts.saturated > 10
    assert len(track.steps) == 10
    assert np.hypot(*moves(track)[:, :2].T) == pytest.approx(np.full(10, 1.3), abs=0.08)
    assert track.steps[4].covariance[0, 0] > plain.steps[4].covariance[0, 0]


def test_a_start_in_mid_walk_is_unsure_but_a_start() -> None:
    """Switched on while running on a floor that shakes: not one still moment to take the level from."""
    course = fw.course(fw.MANNERS["running"], 20)
    t, accel, gyro = fw.samples(course, 200, rng=np.random.default_rng(11))
    on = (t > 2.3) & (t < course.landed_s[-1])
    t, accel, gyro = t[on], accel[on], gyro[on] + 0.5 * np.sin(250.0 * t[on])[:, None]
    track = walk_track(t, accel, gyro)
    assert track.steps[0].t_start_s - t[0] >= 3.0
    assert len(track.steps) >= 14
    assert np.hypot(*moves(track)[:, :2].T) == pytest.approx(np.full(len(track.steps), 2.4), abs=0.03)
    assert track.steps[0].covariance[0, 0] > track.steps[-1].covariance[0, 0]


def test_a_level_that_contradicts_every_rest_is_given_up() -> None:
    """The sensor slips by 30 degrees in mid-walk, within one sample."""
    t, accel, gyro = walking(16)
    slip = fw.pitched(np.array([0.5]))[0]
    after = t > 2.0 + 5 * 1.1 + 0.7
    track = walk_track(
        t, np.where(after[:, None], accel @ slip.T, accel), np.where(after[:, None], gyro @ slip.T, gyro)
    )
    assert track.counts.forced > 0
    assert np.hypot(*moves(track)[-6:, :2].T) == pytest.approx(np.full(6, 1.3), abs=0.03)


def test_a_large_gyro_bias_is_learnt_while_standing() -> None:
    t, accel, gyro = fw.samples(fw.course(fw.MANNERS["walking"], 10), 100)
    standing = np.arange(300)
    t = np.concatenate([standing / 100.0, t + 3.0])
    accel, gyro = np.vstack([accel[:1].repeat(300, 0), accel]), np.vstack([gyro[:1].repeat(300, 0), gyro])
    track = walk_track(t, accel, gyro + [0.05, -0.05, 0.05])
    walked = track.heading_rad[-1] - track.heading_rad[450]
    assert abs(walked) < 0.03


@settings(max_examples=60)
@given(
    table=arrays(
        np.float64, st.tuples(st.integers(1, 60), st.just(7)), elements=st.floats(allow_nan=True, allow_infinity=True)
    ),
    scale=st.sampled_from([1.0, 1e-3, 1e-300]),
)
def test_any_numbers_are_survived(table: Floats, scale: float) -> None:
    t, accel, gyro = walking(2)
    with np.errstate(over="ignore", invalid="ignore"):
        table = table * scale
    foot = Foot()
    foot.feed(t[:300], accel[:300], gyro[:300])
    foot.feed(table[:, 0], table[:, 1:4], table[:, 4:7])
    foot.feed(t[300:], accel[300:], gyro[300:])
    counts = foot.counts
    assert counts.samples + counts.impossible + counts.not_later == len(t) + len(table)
    assert np.isfinite(foot.position_m).all()
    assert math.isfinite(foot.heading_rad)
    assert np.isfinite(foot._nav.P).all()


def test_wrong_shapes_are_refused_in_one_line() -> None:
    with pytest.raises(ValueError, match="expected"):
        Foot().feed(np.zeros(3), np.zeros((3, 3)), np.zeros((2, 3)))
    assert Foot().feed(np.empty(0), np.empty((0, 3)), np.empty((0, 3))) == []
