# SPDX-License-Identifier: MIT
"""The beacons' kernels against their slow twins: one measurement of any cloud, a beacon's place, whole walks."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from echostep.arrays import Floats
from echostep.beacons.beliefs import BeaconBeliefs, BeaconMeasurement, empty_beliefs, moments, place_covariance
from echostep.beacons.initialisation import locate_beacon
from echostep.beacons.model import BeaconSettings, beacon_model
from echostep.beacons.slam import (
    CLOUD_FIT,
    LOST_FIT,
    initial_health,
    propose_heading_jumps,
    reweight,
    update_by_measurement,
)
from echostep.beacons.step import MOST_READINGS, Beacons, no_waiting, update_by_reading
from echostep.particles.arrays import ParticleArrays
from echostep.walls.index import build_index
from naive import beacon_readings as naive_readings
from naive import beacons as naive

MODEL = beacon_model(BeaconSettings())
UPPER = np.triu_indices(3)  # the order in which the kernels store a covariance
NOTHING = np.zeros((0, 4))


def any_cloud(rng: np.random.Generator, n: int, beacons: int) -> tuple[ParticleArrays, BeaconBeliefs]:
    """Particles within metres of beacons that they believe well, vaguely or not at all, with and without an axis."""
    x, y = rng.normal(0.0, rng.choice([0.1, 3.0]), (2, n))
    particles = ParticleArrays(x, y, rng.uniform(-3.0, 3.0, n), np.ones(n), -rng.exponential(2.0, n))
    root = rng.normal(0.0, 1.0, (n, beacons, 3, 3)) * rng.choice([0.0, 0.03, 0.3, 1.5], (n, beacons, 1, 1))
    cov = root @ root.transpose(0, 1, 3, 2)
    unknown = rng.random((n, beacons)) < 0.3
    cov[unknown, 2, :] = cov[unknown, :, 2] = 0.0
    cov[unknown, 2, 2] = rng.choice([math.pi**2, 1.5], int(unknown.sum()))
    mean = rng.normal(0.0, [rng.choice([0.3, 4.0])] * 2 + [2.0], (n, beacons, 3))
    mean[..., 2] = np.angle(np.exp(1j * mean[..., 2]))
    return particles, BeaconBeliefs(
        mean, np.ascontiguousarray(cov[..., *UPPER]), np.exp(rng.uniform(-3.0, 5.0, (n, beacons)))
    )


def twin_of(particles: ParticleArrays, beliefs: BeaconBeliefs) -> list[naive.Particle]:
    cloud = []
    for i, (x, y, turn, _, log_weight) in enumerate(zip(*particles, strict=True)):
        each = []
        for mean, terms, doubt in zip(*(part[i] for part in beliefs), strict=True):
            cov = np.zeros((3, 3))
            cov[UPPER] = cov.T[UPPER] = terms
            each.append(naive.Belief(mean.copy(), cov, float(doubt)))
        cloud.append(naive.Particle(np.array([x, y]), float(turn), float(log_weight), each))
    return cloud


def assert_same(particles: ParticleArrays, beliefs: BeaconBeliefs, cloud: list[naive.Particle]) -> None:
    """Every particle and every belief; axes up to whole turns."""
    assert particles.x_m == pytest.approx(np.array([p.place[0] for p in cloud]), abs=1e-7)
    assert particles.y_m == pytest.approx(np.array([p.place[1] for p in cloud]), abs=1e-7)
    assert particles.turn_rad == pytest.approx(np.array([p.turn for p in cloud]))
    assert particles.log_weight == pytest.approx(np.array([p.log_weight for p in cloud]), rel=1e-7, abs=1e-7)
    mean = np.array([[b.mean for b in p.beliefs] for p in cloud])
    np.testing.assert_allclose(beliefs.mean[..., :2], mean[..., :2], atol=1e-7)
    np.testing.assert_allclose(np.exp(1j * beliefs.mean[..., 2]), np.exp(1j * mean[..., 2]), atol=1e-7)
    np.testing.assert_allclose(beliefs.cov, [[b.cov[UPPER] for b in p.beliefs] for p in cloud], atol=1e-7)
    np.testing.assert_allclose(beliefs.doubt, [[b.doubt for b in p.beliefs] for p in cloud], rtol=1e-6)


@settings(max_examples=100)
@given(st.integers(0, 2**32 - 1), st.booleans())
def test_one_measurement_of_any_cloud_is_that_of_the_twin(seed: int, walled: bool) -> None:
    rng = np.random.default_rng(seed)
    particles, beliefs = any_cloud(rng, 8, 2)
    walls = rng.uniform(-4.0, 4.0, (3, 4)) if walled else NOTHING
    cloud, slot = twin_of(particles, beliefs), int(rng.integers(2))
    away = math.hypot(particles.x_m[0] - beliefs.mean[0, slot, 0], particles.y_m[0] - beliefs.mean[0, slot, 1])
    range_m = rng.choice([away, rng.uniform(0.0, 20.0)])
    measurement = BeaconMeasurement(slot, float(range_m), float(rng.choice([math.nan, rng.uniform(-4.0, 4.0)])))
    found = reweight(particles, beliefs, measurement, MODEL, build_index(walls))
    assert found == pytest.approx(naive.reweight(cloud, measurement, MODEL, walls))
    assert_same(particles, beliefs, cloud)
    assert particles.log_weight.max() == 0.0


@given(st.integers(0, 2**32 - 1), st.integers(1, 30))
def test_moments_are_those_of_the_twin(seed: int, n: int) -> None:
    particles, beliefs = any_cloud(np.random.default_rng(seed), n, 2)
    cloud, weight = twin_of(particles, beliefs), np.exp(particles.log_weight)
    weight /= weight.sum()
    for slot, found in enumerate(moments(beliefs, weight)):
        place, cov, axis = naive.moments(cloud, slot)
        assert found == pytest.approx([*place, math.sqrt(0.5 * np.trace(cov)), axis], abs=1e-6)
        if n > 1:
            assert place_covariance(beliefs, slot, weight) == pytest.approx(cov, abs=1e-9)


def test_jumps_are_those_of_the_twin() -> None:
    found, expected = np.zeros((2, 2, 2000))
    propose_heading_jumps(found[0], found[1], 0.7, MODEL, np.random.default_rng(5))
    naive.jump(expected[0], expected[1], 0.7, MODEL, np.random.default_rng(5))
    assert np.count_nonzero(found[0]) > 20
    assert found == pytest.approx(expected)


@given(st.integers(0, 2**32 - 1))
def test_a_lost_cloud_recovers_as_its_twin(seed: int) -> None:
    """A wrong measurement is one too many: some particles go where it allows, about a known axis or all around."""
    rng = np.random.default_rng(seed)
    particles, beliefs = any_cloud(rng, 8, 2)
    cloud, health = twin_of(particles, beliefs), initial_health(2)
    measurement = BeaconMeasurement(0, 14.0, float(rng.choice([math.nan, rng.uniform(-4.0, 4.0)])))
    health.all[CLOUD_FIT] = LOST_FIT
    draws = np.random.default_rng(seed), np.random.default_rng(seed)
    update_by_measurement(particles, beliefs, health, measurement, MODEL, build_index(NOTHING), draws[0])
    fit, _ = naive.reweight(cloud, measurement, MODEL, NOTHING)
    if fit < LOST_FIT:
        naive.recover(cloud, measurement, MODEL, draws[1])
    assert_same(particles, beliefs, cloud)


def any_readings(rng: np.random.Generator) -> Floats:
    """Of a beacon that is passed on a straight or bent path, with wrong ranges and missing bearings."""
    n = int(rng.integers(11, 18))
    at = np.column_stack([np.linspace(0.0, rng.uniform(2.5, 4.5), n), np.zeros(n)])
    at[n // 2 :, 1] += np.linspace(0.0, rng.choice([0.0, 1.5, 3.0]), n - n // 2)
    away = at - rng.uniform([0.0, 0.5], [4.0, 2.5])
    range_m = np.hypot(*away.T) + rng.normal(0.0, 0.1, n)
    wrong = rng.random(n) < rng.choice([0.0, 0.2, 0.6])
    range_m[wrong] = rng.uniform(0.2, 5.0, int(wrong.sum()))
    bearing = np.arctan2(away[:, 1], away[:, 0]) + rng.uniform(-3.0, 3.0) + rng.normal(0.0, 0.4, n)
    bearing[rng.random(n) < rng.choice([0.0, 0.3, 1.0])] = math.nan
    return np.column_stack([at, range_m, bearing])


@pytest.mark.slow
def test_a_place_is_that_of_the_twin() -> None:
    rng = np.random.default_rng(6)
    verdicts = []
    for _ in range(24):
        readings = any_readings(rng)
        found = locate_beacon(readings)
        place, sure = naive_readings.locate(readings)
        verdicts.append((sure, bool(np.isnan(place[0]))))
        assert found.sure == sure
        if sure or np.isnan(place[0]):
            assert (found.x_m, found.y_m) == pytest.approx(place.tolist(), nan_ok=True)
        else:  # one of several that cost the same
            other = naive_readings.cost(readings, np.array([found.x_m, found.y_m]))
            assert other == pytest.approx(naive_readings.cost(readings, place))
    assert {(True, False), (False, False), (False, True)} == set(verdicts)


def assert_waits_as_its_twin(rows: list[tuple[float, float, float]]) -> bool:
    """Readings (x, y, range) of a beacon that is not placed yet, by three particles; returns whether it was placed."""
    rng, beacons = np.random.default_rng(1), Beacons(empty_beliefs(3, 1), initial_health(1), no_waiting(1))
    particles = ParticleArrays(np.zeros(3), np.zeros(3), np.zeros(3), np.ones(3), np.array([0.0, -1.0, -0.2]))
    twin = naive_readings.Beacons(twin_of(particles, beacons.beliefs), 1)
    for x, y, range_m in rows:
        for i, p in enumerate(twin.cloud):
            p.place = np.array([x + 0.1 * i, y - 0.2 * i])
            particles.x_m[i], particles.y_m[i] = p.place
        measurement = BeaconMeasurement(0, range_m, math.nan)
        update_by_reading(particles, beacons, measurement, MODEL, build_index(NOTHING), False, rng)
        twin.read(measurement, MODEL, NOTHING, False, rng)
        assert_same(particles, beacons.beliefs, twin.cloud)
        assert beacons.waiting.taken[0] == len(twin.known[0].waiting)
    assert beacons.health.known[0] == twin.known[0].placed
    return twin.known[0].placed


@pytest.mark.parametrize("from_afar", range(6))
@pytest.mark.parametrize("near", [0.99, 1.01])
def test_a_beacon_is_dropped_as_by_its_twin(from_afar: int, near: float) -> None:
    """Within two standard deviations of its place, among its first readings."""
    rows = [(0.1 * t, 0.0, 5.0) for t in range(from_afar)]
    assert assert_waits_as_its_twin([*rows, (0.5, 0.0, near)]) == (from_afar < 4 and near < 1.0)


def test_a_long_wait_is_that_of_the_twin() -> None:
    """A straight path leaves open on which side the beacon lies; its bend tells. The first readings, wrong ones, are forgotten by then."""
    wrong = [(0.0, 0.0, 3.5)] * 20
    there = [(x, 0.0, math.hypot(x - 1.5, 1.2)) for x in np.linspace(0.0, 3.0, MOST_READINGS - 8).tolist()]
    bend = [(3.0, y, math.hypot(1.5, y - 1.2)) for y in np.linspace(0.1, 2.0, 16).tolist()]
    assert assert_waits_as_its_twin([*wrong, *there, *bend])
    assert not assert_waits_as_its_twin([*wrong, *there])


def walk(rng: np.random.Generator) -> list[tuple[float, int, float, float]]:
    """Place along a corridor, beacon, range, bearing: one is dropped at the start and vanishes, one is carried off, one is heard from afar."""
    rows = []
    places = np.array([(0.3, 0.2), (6.0, 2.0), (3.0, -2.5)])
    for t in range(240):
        at = abs((0.1 * t + 6.0) % 12.0 - 6.0)
        if t == 120:
            places[2] = 1.0, 3.0
        slot = int(rng.integers(3))
        dx, dy = at - places[slot, 0], -places[slot, 1]
        range_m, bearing = math.hypot(dx, dy) + rng.normal(0.0, 0.1), math.atan2(dy, dx) + rng.normal(0.0, 0.3)
        rows.append((at, slot, rng.uniform(0.0, 12.0) if rng.random() < 0.1 else abs(range_m), bearing))
    return rows


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "lost_from", "recoveries"), [(1, 240, 0), (2, 150, 2), (3, 60, 4)])
def test_a_walk_is_that_of_the_twin(seed: int, lost_from: int, recoveries: int) -> None:
    """Every beacon is placed, one is found moved and placed anew; a cloud that is led astray recovers."""
    rng, n = np.random.default_rng(seed), 10
    draws = np.random.default_rng(9), np.random.default_rng(9)
    walls = np.array([(2.0, -1.0, 2.0, -4.0), (4.0, 1.0, 4.5, 3.0)])
    beacons = Beacons(empty_beliefs(n, 3), initial_health(3), no_waiting(3))
    x, y = rng.normal(0.0, 0.1, (2, n))
    particles = ParticleArrays(x, y, np.zeros(n), np.ones(n), np.zeros(n))
    twin = naive_readings.Beacons(twin_of(particles, beacons.beliefs), 3)
    index, before = build_index(walls), 0.0
    for t, (at, slot, range_m, bearing) in enumerate(walk(rng)):
        steps = (at - before) * (-1.0 if t > lost_from else 1.0) + rng.normal(0.0, 0.02, n)
        before = at
        particles.x_m[:] += steps
        for p, step in zip(twin.cloud, steps.tolist(), strict=True):
            p.place = p.place + [step, 0.0]
        measurement = BeaconMeasurement(slot, range_m, math.nan if t % 5 == 0 else bearing)
        size = update_by_reading(particles, beacons, measurement, MODEL, index, t % 3 > 0, draws[0])
        assert size == pytest.approx(twin.read(measurement, MODEL, walls, t % 3 > 0, draws[1]), rel=1e-6)
        assert_same(particles, beacons.beliefs, twin.cloud)
        if size < 0.5 * n:
            share = np.exp(particles.log_weight)
            chosen = np.sort(rng.choice(n, n, p=share / share.sum()))
            for part in (*particles[:3], *beacons.beliefs):
                part[:] = part[chosen]
            particles.log_weight[:] = 0.0
            twin.cloud = twin_of(particles, beacons.beliefs)
    health = [[k.in_place, k.measurements, k.times_moved, k.suspect] for k in twin.known]
    np.testing.assert_allclose(beacons.health.each, np.array(health, np.float64), atol=1e-6)
    assert beacons.health.all == pytest.approx([twin.cloud_fit, twin.recoveries])
    assert beacons.waiting.taken.tolist() == [len(k.waiting) for k in twin.known]
    assert beacons.health.known.tolist() == [k.placed for k in twin.known] == [True] * 3
    assert twin.recoveries == recoveries
    assert twin.known[2].times_moved == 1
