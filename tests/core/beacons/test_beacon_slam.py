# SPDX-License-Identifier: MIT
"""Beacons in the cloud: what a measurement does to particles and to what they believe of the beacon; moved beacons are noticed."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from echostep.beacons.beliefs import (
    XX,
    XY,
    YY,
    BeaconBeliefs,
    BeaconMeasurement,
    empty_beliefs,
    set_beliefs,
)
from echostep.beacons.model import BeaconSettings, beacon_model
from echostep.beacons.slam import CLOUD_FIT, SUSPECT, TIMES_MOVED, initial_health, reweight, update_by_measurement
from echostep.beacons.step import Beacons, no_waiting, update_by_reading
from echostep.elementary import wrap_angle
from echostep.particles.arrays import ParticleArrays
from echostep.walls.echo_sources import Walls
from echostep.walls.index import WallIndex

MODEL = beacon_model(BeaconSettings())
Floats = np.ndarray


def walls(*rows: tuple[float, float, float, float]) -> WallIndex:
    plan = Walls(np.array(rows, np.float64).reshape(-1, 4))
    return plan.near(np.zeros(1), np.zeros(1), 20.0)


OPEN = walls()


def weigh(
    x: Floats,
    y: Floats,
    weight: Floats,
    beliefs: BeaconBeliefs,
    range_m: float,
    bearing: float,
    index: WallIndex = OPEN,
) -> tuple[float, float]:
    particles = ParticleArrays(x, y, np.zeros(len(x)), np.ones(len(x)), weight)
    return reweight(particles, beliefs, BeaconMeasurement(0, range_m, bearing), MODEL, index)


def ring(n: int, radius_m: float) -> tuple[Floats, Floats]:
    angle = np.linspace(-math.pi, math.pi, n, endpoint=False)
    return radius_m * np.cos(angle), radius_m * np.sin(angle)


def test_wall_on_the_line_of_sight_makes_a_fitting_range_less_likely() -> None:
    seen = []
    for index in (OPEN, walls((1.0, -5.0, 1.0, 5.0))):
        weight, beliefs = np.zeros(1), empty_beliefs(1, 1)
        set_beliefs(beliefs, 0, 0.0, 0.0, 0.0, 0.0, 0.0)
        seen.append(weigh(np.full(1, 2.0), np.zeros(1), weight, beliefs, 2.0, math.nan, index)[0])
    assert seen[1] < seen[0] - 0.005


def test_place_and_axis_are_learnt_from_a_walk_around() -> None:
    rng = np.random.default_rng(1)
    n, true = 20, (1.0, -0.5, 0.7)
    beliefs, weight = empty_beliefs(n, 1), np.zeros(n)
    set_beliefs(beliefs, 0, 0.0, 0.0, 0.0, 1.0, math.pi**2)
    for angle in np.linspace(0.0, 2.0 * math.pi, 200):
        x, y = true[0] + 3.0 * math.cos(angle), true[1] + 3.0 * math.sin(angle)
        bearing = wrap_angle(angle - true[2] + math.radians(30.0) * rng.standard_normal())
        weigh(np.full(n, x), np.full(n, y), weight, beliefs, 3.0 + 0.05 * rng.standard_normal(), bearing)
    place_off = beliefs.mean[:, 0, :2] - true[:2]
    assert np.hypot(*place_off.T).max() < 0.15
    assert np.abs(beliefs.mean[:, 0, 2] - true[2]).max() < 0.15
    assert beliefs.cov[:, 0, 5].max() < 0.02


@pytest.mark.slow
@pytest.mark.parametrize("away_m", [0.2, 0.5, 3.0])
def test_ranges_from_beside_a_beacon_make_no_belief_surer_than_right(away_m: float) -> None:
    """Six ranges from around the believed place: the normalised square of the error is 2 where a belief is right."""
    rng, sd_m, squares = np.random.default_rng(1), 1.2, []
    for _ in range(300):
        true = sd_m * rng.standard_normal(2)
        beliefs = empty_beliefs(1, 1)
        set_beliefs(beliefs, 0, 0.0, 0.0, 0.0, sd_m**2, 0.0)
        for x, y in zip(*ring(6, away_m), strict=True):
            range_m = math.hypot(x - true[0], y - true[1]) + MODEL.range_sd_m * rng.standard_normal()
            weigh(np.array([x]), np.array([y]), np.zeros(1), beliefs, abs(range_m), math.nan)
        off, cov = true - beliefs.mean[0, 0, :2], beliefs.cov[0, 0]
        squares.append(off @ np.linalg.inv([[cov[XX], cov[XY]], [cov[XY], cov[YY]]]) @ off)
    assert np.mean(squares) < 3.0


def test_moved_beacon_is_noticed_while_others_vouch_for_the_cloud() -> None:
    rng = np.random.default_rng(2)
    n = 100
    x, y = 0.05 * rng.standard_normal(n), 0.05 * rng.standard_normal(n)
    turn, weight, health = np.zeros(n), np.zeros(n), initial_health(3)
    beliefs = empty_beliefs(n, 3)
    at = [(4.0, 0.0), (0.0, 4.0), (-4.0, 0.0)]
    for k, (bx, by) in enumerate(at):
        set_beliefs(beliefs, k, bx, by, 0.0, 0.0, 0.0)
    health.known[:] = True
    for _ in range(60):
        for k, range_m in enumerate((4.0, 4.0, 7.0)):  # the third lies 3 m further off than believed
            particles = ParticleArrays(x, y, turn, np.ones(n), weight)
            update_by_measurement(particles, beliefs, health, BeaconMeasurement(k, range_m, math.nan), MODEL, OPEN, rng)
        chosen = np.sort(rng.choice(n, n, p=np.exp(weight) / np.exp(weight).sum()))
        weight[:], x[:], y[:] = 0.0, x[chosen], y[chosen]
        for part in beliefs:
            part[:] = part[chosen]
    assert health.each[:2, TIMES_MOVED].tolist() == [0.0, 0.0]
    assert health.each[2, TIMES_MOVED] >= 1.0
    assert health.all[CLOUD_FIT] > 0.5
    assert beliefs.doubt[:, 2].min() > math.exp(3.0)
    assert np.abs(beliefs.mean[:, 2, 0] + 4.0).max() < 0.1  # nobody learns from it
    assert np.hypot(x.mean(), y.mean()) < 0.1


@given(
    st.floats(0.0, 1e6), st.floats(-10.0, 10.0), st.floats(-1e3, 1e3), st.floats(-1e3, 1e3), st.floats(0.0, 1e4), st.floats(0.0, 20.0)
)  # fmt: skip
def test_no_measurement_makes_a_belief_infinite(
    range_m: float, bearing: float, x: float, y: float, place_var: float, axis_var: float
) -> None:
    beliefs, weight = empty_beliefs(3, 1), np.zeros(3)
    set_beliefs(beliefs, 0, 0.0, 0.0, 0.0, place_var, axis_var)
    for _ in range(3):
        weigh(np.full(3, x), np.full(3, y), weight, beliefs, range_m, bearing)
    assert np.isfinite(weight).all()
    assert all(np.isfinite(part).all() for part in beliefs)
    assert (beliefs.cov[:, 0, (0, 3, 5)] >= -1e-9).all()


def test_beacon_that_was_moved_costs_no_more_than_a_moved_one_and_is_trusted_again() -> None:
    """A particle that one beacon contradicts for long is left with the others' word; when it fits again it counts again."""
    beliefs, weight = empty_beliefs(1, 1), np.zeros(1)
    set_beliefs(beliefs, 0, 0.0, 0.0, 0.0, 0.0, 0.0)
    at = np.full(1, 4.0), np.zeros(1)
    trust = [weigh(*at, weight, beliefs, 8.0, math.nan)[0] for _ in range(20)]
    assert trust[0] > 0.8
    assert trust[-1] < 0.05
    assert beliefs.doubt[0, 0] < math.exp(8.0)
    trust = [weigh(*at, weight, beliefs, 4.0, math.nan)[0] for _ in range(10)]
    assert trust[-1] > 0.95


def found_moved(plan_supports: bool) -> tuple[Beacons, Floats]:
    """Beacons after a walk of 24 m past three of them, of which the last lies at (6, 3) instead of (6, -6); and the places that particles believe."""
    rng, n = np.random.default_rng(4), 50
    true = np.array([(2.0, 2.0), (12.0, 2.0), (6.0, 3.0)])
    beacons = Beacons(empty_beliefs(n, 3), initial_health(3), no_waiting(3))
    for k, (x, y) in enumerate([(2.0, 2.0), (12.0, 2.0), (6.0, -6.0)]):
        set_beliefs(beacons.beliefs, k, x, y, 0.0, 0.01, 0.01)
    beacons.health.known[:] = True
    for s in np.arange(0.0, 24.0, 0.15):
        at = min(s, 24.0 - s)
        particles = ParticleArrays(np.full(n, at), np.zeros(n), np.zeros(n), np.ones(n), np.zeros(n))
        for k, (x, y) in enumerate(true):
            reading = BeaconMeasurement(k, math.hypot(x - at, y), wrap_angle(math.atan2(-y, at - x)))
            update_by_reading(particles, beacons, reading, MODEL, OPEN, plan_supports, rng)
    return beacons, beacons.beliefs.mean[:, 2, :2]


def test_moved_beacon_is_doubted_until_the_plan_supports_the_cloud() -> None:
    alone, places = found_moved(False)
    assert alone.health.each[2, SUSPECT] == 1.0
    assert alone.health.known[2]
    assert np.abs(places - (6.0, -6.0)).max() < 0.5  # nothing is learnt from it
    assert alone.beliefs.doubt[:, 2].min() > 3.0
    supported, places = found_moved(True)
    assert supported.health.each[:, SUSPECT].tolist() == [0.0, 0.0, 0.0]
    assert supported.health.each[2, TIMES_MOVED] == 1.0
    assert np.abs(places - (6.0, 3.0)).max() < 0.5
