# SPDX-License-Identifier: MIT
"""The foot: kernels against textbook twins, walks whose truth is known, hostile samples, real recordings."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from echostep.arrays import Floats
from echostep.foot import ins
from echostep.foot.steps import Foot
from foot.foot_walks import walking


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


@pytest.mark.slow
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


@pytest.mark.parametrize(
    ("update", "measured", "kept"),
    [
        (ins.update, range(ins.SIZE), slice(0)),
        (ins.update_but_gyro_bias, range(ins.VEL, ins.VEL + 3), slice(ins.GYRO_BIAS, ins.GYRO_BIAS + 3)),
    ],
)
def test_update_agrees_with_the_textbook(update: Callable[..., None], measured: range, kept: slice) -> None:
    """The gain of what is kept is zero; the covariance that follows from any gain, optimal or not, is Joseph's."""
    rng = np.random.default_rng(4)
    for at in measured:
        nav = some_nav(rng)
        before = copied(nav)
        error, variance = 1e-3 * float(rng.standard_normal()), 0.3
        update(nav, at, error, variance)
        h = np.eye(ins.SIZE)[at : at + 1]
        gain = before.P @ h.T / (h @ before.P @ h.T + variance)
        gain[kept] = 0.0
        joseph = np.eye(ins.SIZE) - gain @ h
        assert pytest.approx(joseph @ before.P @ joseph.T + variance * gain @ gain.T, abs=1e-9) == nav.P
        assert errors_between(before, nav) == pytest.approx((gain * error)[:15, 0], rel=1e-4, abs=1e-9)


def test_covariance_stays_symmetric_and_positive() -> None:
    foot = Foot()
    foot.feed(*walking(40, 200))
    P = foot.nav.P
    scale = np.sqrt(np.diag(P)) + 1e-12
    assert np.abs(P - P.T).max() <= 1e-9 * scale.max() ** 2
    assert np.linalg.eigvalsh(P / np.outer(scale, scale)).min() > -1e-6
