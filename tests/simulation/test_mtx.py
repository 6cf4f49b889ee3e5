# SPDX-License-Identifier: MIT
"""The simulated MTx and its serial delivery."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from echostep.arrays import Floats
from echostep.xsens import MtxReader
from echostep_simulation.devices.mtx import GRAVITY_M_S2, MtxModel, MtxStream, measure, stream
from echostep_simulation.devices.serial_delivery import deliver
from echostep_simulation.people.attitude import rotations
from echostep_simulation.people.walker import RATE_HZ, Person, Walk
from echostep_simulation.world.magnetic_field import EARTH, MagneticField
from simulation.simulated import FAULTLESS, samples_of


@pytest.fixture(scope="module")
def mtx(l_walk: Walk) -> MtxStream:
    return stream(l_walk, MtxModel(), np.random.default_rng(1))


def test_mtdata_frames_have_the_documented_bytes(mtx: MtxStream) -> None:
    for frame in mtx.frames[:100]:
        assert frame[:4] == bytes([0xFA, 0xFF, 0x32, 54])
        assert len(frame) == 59
        assert sum(frame[1:]) & 0xFF == 0
    first = mtx.frames[0]
    assert int.from_bytes(first[56:58], "big") == 65_000
    assert np.frombuffer(first, ">f4", 3, 4)[2] == pytest.approx(GRAVITY_M_S2, abs=0.2)
    assert np.linalg.norm(np.frombuffer(first, ">f4", 4, 40)) == pytest.approx(1.0, abs=1e-6)


def test_the_sample_counter_wraps_without_a_gap(mtx: MtxStream) -> None:
    reader = MtxReader()
    counters = [s.counter for frame in mtx.frames for s in reader.feed(frame)]
    assert counters[535:537] == [65_535, 0]
    assert (reader.counts.lost, reader.counts.good) == (0, len(mtx.frames))


def test_bytes_arrive_after_the_sample_and_in_order(mtx: MtxStream) -> None:
    late = mtx.arrival_s - mtx.t_s
    assert late.min() >= 59 * 10 / 115_200
    assert late.max() < 0.02
    assert np.diff(mtx.arrival_s).min() >= 0.0


def test_the_mtx_crystal_drifts_against_the_board(l_walk: Walk) -> None:
    fast, slow = (stream(l_walk, MtxModel(drift_ppm=ppm), np.random.default_rng(1)).t_s for ppm in (-100.0, 100.0))
    n = min(len(fast), len(slow)) - 1
    assert (slow[n] - slow[0]) / (fast[n] - fast[0]) - 1.0 == pytest.approx(200e-6, rel=1e-3)


def test_the_mtx_world_is_north_west_up(l_walk: Walk) -> None:
    """A foot that points east has its x axis along minus west, and north to its left."""
    sample = samples_of(stream(l_walk, FAULTLESS, np.random.default_rng(1)).frames)[0]
    w, x, y, z = sample.quaternion
    ahead = np.array([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)])
    toe_out = -Person().foot.toe_out_rad
    assert np.allclose(ahead, [math.sin(toe_out), -math.cos(toe_out), 0.0], atol=0.05)
    assert sample.mag[1] > 0.3
    assert sample.mag[2] < -0.8


def test_a_mounting_turns_what_is_felt(l_walk: Walk) -> None:
    upside_down = replace(FAULTLESS, mounting_rpy_rad=(math.pi, 0.0, 0.0))
    sample = samples_of(stream(l_walk, upside_down, np.random.default_rng(1)).frames)[10]
    assert sample.accel[2] == pytest.approx(-GRAVITY_M_S2, abs=1e-3)
    with_z_down = 1.0 - 2.0 * (sample.quaternion[1] ** 2 + sample.quaternion[2] ** 2)
    assert with_z_down == pytest.approx(-1.0, abs=1e-3)


def test_nothing_leaves_the_sensors_range(l_walk: Walk) -> None:
    loud = MtxModel(gyro_noise=10.0, accel_noise=100.0)
    samples = samples_of(stream(l_walk, loud, np.random.default_rng(1)).frames)
    assert np.abs([x.accel for x in samples]).max() == pytest.approx(180.0)
    assert np.degrees(np.abs([x.gyro for x in samples]).max()) == pytest.approx(1200.0)


def test_a_disturbed_field_turns_the_sensors_north_slowly(l_walk: Walk) -> None:
    magnetism = MagneticField(np.random.default_rng(5))
    found = stream(l_walk, FAULTLESS, np.random.default_rng(1), magnetism)
    q = np.array([x.quaternion for x in samples_of(found.frames)])
    yaw = np.arctan2(2 * (q[:, 0] * q[:, 3] + q[:, 1] * q[:, 2]), 1 - 2 * (q[:, 2] ** 2 + q[:, 3] ** 2)) + 0.5 * math.pi
    at = (found.t_s * RATE_HZ).astype(int)
    error = np.degrees((yaw - l_walk.foot_rpy_rad[at, 2] + math.pi) % (2 * math.pi) - math.pi)
    assert 1.0 < np.abs(error).max() < 40.0
    assert np.abs(np.diff(error)).max() < 1.0
    field = magnetism.field(np.random.default_rng(1).uniform(0, 30, (2_000, 2)))
    assert 0.02 < (field - EARTH).std() < 0.1


def test_an_adapter_hands_over_when_its_timer_ends_or_its_packet_is_full() -> None:
    rng = np.random.default_rng(1)
    arrival_s, portions, complete_s = deliver([bytes(59)], np.array([0.01]), 115_200, 0.001, rng)
    assert [len(x) for x in portions] == [11, 12, 11, 12, 11, 2]  # 11.52 bytes a millisecond
    assert arrival_s[0] >= 0.011
    assert complete_s[0] == arrival_s[-1] < 0.02
    _, slow, _ = deliver([bytes(59)] * 4, 0.01 * np.arange(4.0), 115_200, 0.016, rng)
    assert max(len(x) for x in slow) == 62
    assert sum(len(x) for x in slow) == 4 * 59


@given(st.lists(st.integers(1, 100), min_size=1, max_size=20), st.sampled_from([0.001, 0.016]))
def test_delivery_keeps_every_byte_in_order(lengths: list[int], timer_s: float) -> None:
    frames = [bytes([k]) * n for k, n in enumerate(lengths)]
    begin_s = 0.003 * np.arange(float(len(frames)))
    arrival_s, portions, complete_s = deliver(frames, begin_s, 115_200, timer_s, np.random.default_rng(1))
    assert b"".join(portions) == b"".join(frames)
    assert all(portions)
    assert np.diff(arrival_s).min(initial=0.0) >= 0.0
    assert (complete_s - begin_s >= np.array(lengths) * 10 / 115_200 - 1e-12).all()


def test_the_yaw_walks_with_the_root_of_the_way_and_the_field_with_it(l_walk: Walk) -> None:
    """By the differences to an MTx without it, whose errors are the same to the last bit."""
    drift_rad, turns, walked_m = math.radians(2.0), [], 0.0
    for seed in range(20):
        steady, walking = (
            measure(l_walk, replace(MtxModel(), yaw_walk_rad=drift), np.random.default_rng(seed))
            for drift in (0.0, drift_rad)
        )
        assert np.array_equal(steady.accel, walking.accel)
        up = vertical(l_walk, walking.t_s)
        rate = walking.gyro - steady.gyro
        assert np.allclose(np.cross(rate, up), 0.0, atol=1e-9)
        turns.append(np.einsum("ni,ni->n", rate, up) * np.median(np.diff(walking.t_s)))
        at = np.minimum((walking.t_s * RATE_HZ).astype(int), len(l_walk.t_s) - 1)
        walked_m += float(np.hypot(*np.diff(l_walk.foot_m[at, :2], axis=0).T).sum())
        level = [m - np.einsum("ni,ni->n", m, up)[:, None] * up for m in (steady.mag, walking.mag)]
        sine = np.einsum("ni,ni->n", np.cross(level[1], level[0]), up) / (np.linalg.norm(level[0], axis=1) ** 2)
        late = np.abs(np.cumsum(turns[-1])) > math.radians(3.0)
        assert np.allclose(sine[late], np.sin(np.cumsum(turns[-1]))[late], atol=0.1)
    assert math.sqrt(sum(float(np.sum(t**2)) for t in turns) / walked_m) == pytest.approx(drift_rad, rel=0.05)
    still = np.concatenate([t[:200] for t in turns])
    assert np.abs(still).max() < 1e-9


def vertical(walk: Walk, t_s: Floats) -> Floats:
    """The vertical (n, 3) in the axes of a foot sensor."""
    at = np.minimum((t_s * RATE_HZ).astype(int), len(walk.t_s) - 1)
    found: Floats = rotations(walk.foot_rpy_rad[at])[:, 2]
    return found
