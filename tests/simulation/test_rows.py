# SPDX-License-Identifier: MIT
"""Rows of one millisecond for a board."""

from __future__ import annotations

import struct
from dataclasses import replace

import numpy as np
import pytest

from echostep.arrays import Floats
from echostep.plan import Level
from echostep_simulation.devices.board_sensors import Adis16100Model, CompassModel, Scp1000Model, WornGyro
from echostep_simulation.people.walker import Walk
from echostep_simulation.stimulus import NO_SYNC, ROW, BoardSensors
from simulation.simulated import SPEED_M_S


def test_a_row_has_the_layout_of_the_bench() -> None:
    """The fields of host/docs/design/bench.md, one after the other without gaps."""
    row = np.zeros(1, ROW)
    row["thigh"], row["calf"], row["belt"] = -1, 2, 3
    row["own_us"], row["cross_us"] = (4, 5), (6, 7)
    row["bearing"], row["pressure"], row["temperature"], row["sync_us"] = 8, 9, -10, 11
    assert row.tobytes() == struct.pack("<3h2H2HHIhH", -1, 2, 3, 4, 5, 6, 7, 8, 9, -10, 11)


def sensors(walked: Walk, sync_t_s: Floats, seed: int = 1) -> BoardSensors:
    walls = np.array([[-3.0, 1.0, 9.0, 1.0], [-3.0, -1.0, 9.0, -1.0]])
    return BoardSensors(walked, [Level("hall", 0.0, walls)], sync_t_s, np.random.default_rng(seed))


def test_rows_hold_what_the_sensors_would_say(l_walk: Walk) -> None:
    rows = sensors(l_walk, np.zeros(0)).rows(0, 2_000)
    assert len(rows) == 2_000
    assert np.abs(rows["thigh"].astype(float).std() * 0.2439 - 0.5) < 0.15
    assert abs(rows["pressure"].mean() / 4.0 - 101_325.0) < 50.0
    assert abs(rows["temperature"].mean() / 20.0 - 20.0) < 1.0
    assert abs(rows["bearing"].mean() - 900.0) < 200.0  # heading east
    own_m = rows["own_us"] * 0.5e-6 * SPEED_M_S
    assert np.allclose(own_m.mean(0), 1.0, atol=0.12)
    assert (rows["sync_us"] == NO_SYNC).all()


def test_gyro_rows_follow_the_leg_and_stay_within_twelve_bits(l_walk: Walk) -> None:
    rows = sensors(l_walk, np.zeros(0)).rows(0, len(l_walk.t_s))
    for name, rate in (("thigh", l_walk.thigh_rad_s), ("calf", l_walk.calf_rad_s), ("belt", l_walk.belt_rad_s)):
        seen = np.radians(0.2439 * rows[name].astype(float))
        error = seen - rate - (seen[:2_000] - rate[:2_000]).mean()
        assert np.degrees(error[np.degrees(np.abs(rate)) < 250.0]).std() < 1.5
        assert np.abs(rows[name].astype(int)).max() <= 2_048


def test_sync_edges_fall_into_their_millisecond(l_walk: Walk) -> None:
    edges = np.array([0.0004, 0.0100, 0.020999, 0.049])
    rows = sensors(l_walk, edges).rows(0, 50)
    at = np.flatnonzero(rows["sync_us"] != NO_SYNC)
    assert (at * 1_000 + rows["sync_us"][at]).tolist() == [400, 10_000, 20_999, 49_000]


def test_rows_are_equal_for_equal_seeds_and_not_for_others(l_walk: Walk) -> None:
    a, b, c = (sensors(l_walk, np.zeros(0), seed).rows(0, 100).tobytes() for seed in (1, 1, 2))
    assert a == b != c


def test_rows_do_not_depend_on_how_they_are_cut(l_walk: Walk) -> None:
    whole = sensors(l_walk, np.zeros(0)).rows(0, 300)
    cut = sensors(l_walk, np.zeros(0))
    parts = [cut.rows(a, b) for a, b in ((0, 7), (7, 100), (100, 300))]
    assert np.concatenate(parts).tobytes() == whole.tobytes()


def test_gyros_saturate() -> None:
    counts = Adis16100Model(np.random.default_rng(1)).counts(np.radians([-2_000.0, 0.0, 2_000.0]))
    assert counts[[0, 2]].tolist() == [-1230, 1230]


def test_pressure_falls_with_height_and_drifts_slowly() -> None:
    ground, above = (
        Scp1000Model(np.random.default_rng(1)).counts(np.full(5_000, h), 20.0, 5_000)[0].mean() / 4.0
        for h in (0.0, 3.0)
    )
    assert ground - above == pytest.approx(36.0, abs=0.5)
    long = Scp1000Model(np.random.default_rng(1)).counts(np.zeros(600_000), 20.0, 600_000)[0] / 4.0
    minutes = long.reshape(10, -1).mean(1)
    assert 0.1 < np.ptp(minutes) < 20.0


def test_bearings_are_clockwise_from_north() -> None:
    heading = np.radians([90.0, 0.0, -90.0, 180.0])
    seen = CompassModel(None, np.random.default_rng(1)).bearings(np.zeros((4, 2)), heading)
    off = (seen - np.array([0, 900, 1800, 2700]) + 1800) % 3600 - 1800
    assert np.abs(off).max() < 150


@pytest.mark.long
def test_a_worn_gyro_has_the_errors_it_states() -> None:
    """Each alone, over many wearers: scale and jitter in walking, the bias's wander at all times."""
    n, rate_hz = 60_000, 1000.0
    turning = np.full(n, 0.2)
    none = WornGyro(0.0, 0.0, 100.0, 0.0, 0.0, 1.0)
    assert np.array_equal(none.rates(turning, rate_hz, np.random.default_rng(0)), turning)

    def errors(worn: WornGyro, rate: Floats) -> Floats:
        return np.array([worn.rates(rate, rate_hz, np.random.default_rng(k)) - rate for k in range(60)])

    scale = errors(replace(none, scale=0.02), turning) / turning
    assert scale[:, 0].std() == pytest.approx(0.02, rel=0.3)
    assert np.ptp(scale, axis=1).max() < 1e-12
    walking = errors(replace(none, walking_rad_s=0.001), turning)
    assert walking[:, n // 2].std() == pytest.approx(0.001, rel=0.3)
    wander = errors(replace(none, wander_rad_s=0.001), np.zeros(n))
    assert wander[:, -1].std() == pytest.approx(0.001, rel=0.3)
    angle = np.cumsum(errors(replace(none, jitter_rad=0.02), turning), axis=1) / rate_hz
    assert angle[:, 1000:-1000:1000].std() == pytest.approx(0.02, rel=0.3)
    still = errors(replace(none, jitter_rad=0.02, walking_rad_s=0.001), np.zeros(n))
    assert np.abs(still).max() == 0.0
