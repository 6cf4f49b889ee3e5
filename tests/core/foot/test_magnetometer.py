# SPDX-License-Identifier: MIT
"""The magnetometer: trusted in a clean field, where it holds the heading; not trusted in a disturbed one, where it changes nothing."""

from __future__ import annotations

import numpy as np
import pytest

from echostep.arrays import Floats
from echostep.foot.steps import Foot, walk_track
from foot import foot_walks as fw

EARTH = np.array([0.2, 0.05, -0.43])  # gauss, walk frame
IRON = np.array([0.05, -0.08, 0.03])  # of the shoe
STEPS, RATE_HZ = 100, 100
DRIFT_RAD_S = 0.006


def walked(manner: str, field: Floats, seed: int) -> tuple[Floats, Floats, Floats, Floats]:
    """Samples of a walk whose gyros drift after the first rest, and its field (n, 3) or (3,) as felt with a shoe's iron."""
    rng = np.random.default_rng(seed)
    course = fw.course(fw.MANNERS[manner], STEPS)
    mounting = fw.any_rotation(rng)
    t, accel, gyro = fw.samples(course, RATE_HZ, mounting, rng)
    drift = DRIFT_RAD_S * np.clip((t - 3.0) / 10.0, 0.0, 1.0)
    up = mounting @ np.array([0.0, 0.0, 1.0])
    every = len(course.t_s) // len(t)
    rotation = course.rotation[every // 2 :: every][: len(t)]
    mag = np.einsum("nji,nj->ni", rotation, np.broadcast_to(field, (len(t), 3))) + IRON
    mag = mag @ mounting.T + 0.003 * rng.standard_normal((len(t), 3))
    return t, accel, gyro + drift[:, None] * up, mag


def end_error(manner: str, t: Floats, accel: Floats, gyro: Floats, mag: Floats | None) -> tuple[float, tuple[int, int]]:
    track = walk_track(t, accel, gyro, mag=mag)
    turned = track.heading_rad[-1] - STEPS * fw.MANNERS[manner].turn_rad
    return float(abs(np.angle(np.exp(1j * turned)))), track.compass


@pytest.mark.slow
@pytest.mark.parametrize(("manner", "unit"), [("walking", 1.0), ("turning", 100.0), ("turning", 1e-4)])  # gauss, uT, T
def test_a_clean_field_holds_the_heading_in_any_unit(manner: str, unit: float) -> None:
    t, accel, gyro, mag = walked(manner, EARTH, 1)
    without, _ = end_error(manner, t, accel, gyro, None)
    held, (trusted, read) = end_error(manner, t, accel, gyro, mag * unit)
    assert without > 0.4
    assert held < 0.75 * without
    assert 0.5 * read < trusted <= read


@pytest.mark.slow
def test_a_field_that_changes_from_step_to_step_changes_nothing() -> None:
    rng = np.random.default_rng(2)
    t = walked("walking", EARTH, 3)[0]
    step = (t / 1.1).astype(int)
    field = EARTH + 0.15 * rng.standard_normal((step.max() + 1, 3))[step]
    t, accel, gyro, mag = walked("walking", field, 3)
    plain, fused = walk_track(t, accel, gyro), walk_track(t, accel, gyro, mag=mag)
    assert fused.compass[0] == 0
    assert np.array_equal(plain.heading_rad, fused.heading_rad)


@pytest.mark.slow
def test_trust_ends_where_the_field_is_another() -> None:
    """Half the walk in a clean field, half beside a machine that turns it by a radian and makes it stronger: it is not followed there."""
    t = walked("walking", EARTH, 4)[0]
    machine = np.array([-0.3, 0.4, -0.2])
    field = np.where((t > 55.0)[:, None], machine, EARTH)
    t, accel, gyro, mag = walked("walking", field, 4)
    track = walk_track(t, accel, gyro, mag=mag)
    k = int(np.searchsorted(t, 55.0))
    drift = DRIFT_RAD_S * (t[-1] - t[k])
    assert abs(track.heading_rad[-1] - track.heading_rad[k]) < 1.3 * drift + 0.05


@pytest.mark.slow
def test_any_portions_give_the_same_bits_and_broken_fields_are_passed_over() -> None:
    t, accel, gyro, mag = walked("walking", EARTH, 5)
    mag[::7] = np.nan
    whole = walk_track(t, accel, gyro, mag=mag)
    foot = Foot()
    for a in range(0, len(t), 37):
        foot.feed(t[a : a + 37], accel[a : a + 37], gyro[a : a + 37], mag[a : a + 37])
    assert foot.heading_rad == whole.heading_rad[-1]
    assert foot.compass == whole.compass
    assert whole.compass[0] > 0
    assert walk_track(t, accel, gyro, mag=mag * np.nan).compass == (0, 0)
    with pytest.raises(ValueError, match="mag as gyro"):
        foot.feed(t, accel, gyro, mag[1:])


@pytest.mark.slow
def test_after_a_gap_north_is_found_anew() -> None:
    """The foot has turned unseen. Its heading is a new one, and stays: it is not drawn towards the former one from step to step."""
    t, accel, gyro, mag = walked("walking", EARTH, 1)
    c, s = np.cos(1.0), np.sin(1.0)
    later = walked("walking", EARTH @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]), 1)[3]
    kept = ~((t > 50.0) & (t < 51.5))
    track = walk_track(t[kept], accel[kept], gyro[kept], mag=np.where(t[:, None] < 51.0, mag, later)[kept])
    after = np.unwrap(track.heading_rad[t[kept] > 53.0])[: 10 * RATE_HZ]
    assert np.ptp(after) < 0.12 + DRIFT_RAD_S * 10.0
