"""The simulation against hand-computed cases: a foot that integrates back to its path, echoes of simple walls, rows, MTx bytes, the Python board."""

from __future__ import annotations

import itertools
import math
import struct
import sys
from collections import Counter
from importlib.resources import as_file, files
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from echostep.arrays import Floats
from echostep.board import messages as m
from echostep.board.frames import BoardReader, encode
from echostep.errors import EchostepError
from echostep.plan.model import Level, Plan, load_plan
from echostep.ports.chunks import BOARD, MTX, Chunk
from echostep.simulation.devices.board import BoardProcess, PythonBoard
from echostep.simulation.devices.board_sensors import Adis16100Model, CompassModel, Scp1000Model
from echostep.simulation.devices.mtx import GRAVITY_M_S2, MtxModel, MtxStream, specific_force_and_rate, stream
from echostep.simulation.devices.serial_delivery import deliver
from echostep.simulation.people.attitude import quaternions, rotations
from echostep.simulation.people.walker import RATE_HZ, Person, Walk, walk
from echostep.simulation.scenario import Scenario, demo_scenario
from echostep.simulation.stimulus import NO_SYNC, ROW, BoardSensors
from echostep.simulation.world.acoustics import (
    PIPE_RADIUS_M,
    SRF02,
    Acoustics,
    directivity_db,
    rod_db,
    speed_of_sound_m_s,
    wall_db,
)
from echostep.simulation.world.echoes import Echoes, echoes
from echostep.simulation.world.image_sources import wall_edges
from echostep.simulation.world.magnetic_field import EARTH, MagneticField
from echostep.xsens import MtSample, MtxReader

WAYPOINTS = ((0.0, 0.0), (6.0, 0.0), (6.0, 5.0))
SPEED_M_S = 343.2
QUIET = SRF02._replace(noise_m=0.0, threshold_sd_db=0.0)
FAULTLESS = MtxModel(
    gyro_noise=0.0,
    gyro_bias_rad_s=0.0,
    accel_noise=0.0,
    accel_bias_m_s2=0.0,
    mag_noise=0.0,
    drift_ppm=0.0,
    lean_rad=0.0,
)


@pytest.fixture(scope="module")
def l_walk() -> Walk:
    return walk(WAYPOINTS, Person(), np.random.default_rng(1))


@pytest.fixture(scope="module")
def plan() -> Plan:
    with as_file(files("echostep") / "plans" / "demo.json") as path:
        return load_plan(path)


def samples_of(frames: list[bytes]) -> list[MtSample]:
    reader = MtxReader()
    return [sample for frame in frames for sample in reader.feed(frame)]


# The walker


def test_the_walk_stands_walks_and_stands_again(l_walk: Walk) -> None:
    speed = np.hypot(*np.gradient(l_walk.trunk_m, axis=0).T) * RATE_HZ
    assert speed[:2_000].max() < 0.05
    assert speed[-2_000:].max() < 0.05
    assert 0.9 < np.median(speed[5_000:-5_000]) < 1.5
    assert np.allclose(l_walk.trunk_m[0], WAYPOINTS[0], atol=0.05)
    assert np.allclose(l_walk.trunk_m[-1], WAYPOINTS[-1], atol=0.05)
    assert l_walk.heading_rad[-1] - l_walk.heading_rad[0] == pytest.approx(0.5 * math.pi, abs=0.02)


def test_a_flat_foot_is_truly_still(l_walk: Walk) -> None:
    both = l_walk.flat[1:] & l_walk.flat[:-1]
    assert 0.3 < l_walk.flat[4_000:-4_000].mean() < 0.5
    assert np.abs(np.diff(l_walk.foot_m, axis=0)[both]).max() < 1e-12
    assert np.abs(np.diff(l_walk.foot_rpy_rad, axis=0)[both]).max() < 1e-12


def test_the_trunk_passes_over_the_foot_in_the_middle_of_its_stance(l_walk: Walk) -> None:
    starts = np.flatnonzero(np.diff(l_walk.flat.astype(int)) == 1) + 1
    ends = np.flatnonzero(np.diff(l_walk.flat.astype(int)) == -1)[1:]
    for start, end in zip(starts[:-1], ends, strict=True):
        middle = (start + end) // 2
        dx, dy = l_walk.foot_m[middle, :2] - l_walk.trunk_m[middle]
        heading = l_walk.heading_rad[middle]
        forward = dx * math.cos(heading) + dy * math.sin(heading)
        left = dy * math.cos(heading) - dx * math.sin(heading)
        assert abs(forward) < 0.05
        assert left == pytest.approx(-0.08, abs=0.05)


def test_a_person_stops_turns_on_the_spot_and_goes_back() -> None:
    walked = walk(((0.0, 0.0), (4.0, 0.0, 2.0), (0.0, 0.0)), Person(), np.random.default_rng(1))
    speed = np.hypot(*np.gradient(walked.trunk_m, axis=0).T) * RATE_HZ
    paused = (np.abs(walked.trunk_m[:, 0] - 4.0) < 0.02) & (speed < 0.01) & walked.flat
    assert 1.5 < paused.sum() / RATE_HZ < 4.0
    assert np.degrees(np.abs(np.gradient(walked.heading_rad)) * RATE_HZ).max() < 200.0
    assert np.cos(walked.heading_rad[-1] - walked.heading_rad[0]) == pytest.approx(-1.0, abs=1e-3)
    assert np.allclose(walked.trunk_m[-1], 0.0, atol=0.02)


def test_the_foot_moves_as_feet_do(l_walk: Walk) -> None:
    velocity = np.diff(l_walk.foot_m, axis=0) * RATE_HZ
    force = np.diff(velocity, axis=0) * RATE_HZ
    assert 3.0 < np.abs(velocity[:, :2]).max() < 6.0
    assert np.abs(force).max() < 60.0
    assert 0.05 < np.ptp(l_walk.foot_m[:, 2]) < 0.25
    assert l_walk.foot_m[:, 2].min() == pytest.approx(l_walk.foot_m[0, 2], abs=0.005)
    assert np.degrees(l_walk.foot_rpy_rad[:, 1].max()) == pytest.approx(60.0, abs=10.0)
    assert np.degrees(l_walk.foot_rpy_rad[:, 1].min()) == pytest.approx(-22.0, abs=5.0)


def test_leg_rates_are_those_of_a_gait(l_walk: Walk) -> None:
    for rate in (l_walk.thigh_rad_s, l_walk.calf_rad_s):
        swing = np.cumsum(rate) / RATE_HZ
        middle = swing[5_000:-5_000]
        assert 30.0 < np.degrees(middle.max() - middle.min()) < 85.0
        assert abs(swing[-1]) < math.radians(8.0)
        assert np.degrees(np.abs(rate)).max() < 500.0


# The foot's sensors


def strapdown(force: Floats, rate: Floats, r0: Floats, dt_s: float) -> Floats:
    """Position (n, 3) by integrating specific force and angular rate (n, 3) from rest: naive, small steps."""
    r, v, p = r0.copy(), np.zeros(3), np.zeros(3)
    path = np.zeros((len(force), 3))
    for k, (f, w) in enumerate(zip(force, rate, strict=True)):
        v = v + (r @ f - [0.0, 0.0, GRAVITY_M_S2]) * dt_s
        p = p + v * dt_s
        path[k] = p
        r = r @ rotation_of(w * dt_s)
    return path


def rotation_of(turn: Floats) -> Floats:
    """Rotation matrix of a rotation vector (Rodrigues)."""
    angle = float(np.linalg.norm(turn))
    x, y, z = turn
    k = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    a, b = (1.0, 0.5) if angle < 1e-9 else (math.sin(angle) / angle, (1.0 - math.cos(angle)) / angle**2)
    return np.eye(3) + a * k + b * (k @ k)


def test_what_the_foot_feels_integrates_back_to_its_path(l_walk: Walk) -> None:
    force, rate = specific_force_and_rate(l_walk)
    r0 = rotations(l_walk.foot_rpy_rad[:1])[0]
    path = strapdown(force, rate, r0, 1.0 / RATE_HZ)
    truth = l_walk.foot_m - l_walk.foot_m[0]
    assert np.hypot(*truth[-1, :2]) > 7.0
    assert np.abs(path[:-1] - truth[1:]).max() < 0.005  # of 11 m in 16 s; 1e-4 m/s2 would already give 1 cm


def test_a_standing_foot_feels_gravity_and_nothing_else(l_walk: Walk) -> None:
    force, rate = specific_force_and_rate(l_walk)
    assert np.allclose(force[10:2_000], [0.0, 0.0, GRAVITY_M_S2], atol=1e-9)
    assert np.allclose(rate[10:2_000], 0.0, atol=1e-12)
    assert np.abs(force).max() < 180.0
    assert np.degrees(np.abs(rate)).max() < 1200.0


@pytest.mark.parametrize("rate_hz", [100.0, 200.0])
def test_samples_are_means_over_their_interval(l_walk: Walk, rate_hz: float) -> None:
    found = stream(l_walk, MtxModel(**{**vars_of(FAULTLESS), "rate_hz": rate_hz}), np.random.default_rng(1))
    force, rate = specific_force_and_rate(l_walk)
    samples = samples_of(found.frames)
    n = int(RATE_HZ / rate_hz)
    for k in (len(samples) // 3, len(samples) // 2):
        end = round(found.t_s[k] * RATE_HZ)
        assert np.allclose(samples[k].accel, force[end - n : end + 1].mean(0), atol=0.4)
        assert np.allclose(samples[k].gyro, rate[end - n : end + 1].mean(0), atol=0.2)


def vars_of(model: MtxModel) -> dict[str, Any]:
    return {name: getattr(model, name) for name in MtxModel.__dataclass_fields__}


def test_mtx_means_carry_the_whole_turn(l_walk: Walk) -> None:
    found = stream(l_walk, FAULTLESS, np.random.default_rng(1))
    gyro = np.array([s.gyro for s in samples_of(found.frames)])
    r = rotations(l_walk.foot_rpy_rad[:1])[0]
    for w in gyro * 0.01:
        r = r @ rotation_of(w)
    yaw = math.atan2(r[1, 0], r[0, 0])
    assert yaw - l_walk.foot_rpy_rad[0, 2] == pytest.approx(0.5 * math.pi, abs=math.radians(1.0))


@given(st.tuples(*[st.floats(-math.pi, math.pi)] * 3))
def test_quaternions_are_the_rotations(rpy: tuple[float, float, float]) -> None:
    r = rotations(np.array([rpy]))
    w, x, y, z = quaternions(r)[0]
    again = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    assert np.allclose(again, r[0], atol=1e-9)


# The MTx


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
    upside_down = MtxModel(**{**vars_of(FAULTLESS), "mounting_rpy_rad": (math.pi, 0.0, 0.0)})
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


# Echoes


def listen(
    walls: list[list[float]], acoustics: Acoustics = QUIET, *, at: tuple[float, float] = (0.0, 0.0), heading_deg: float = 0.0, n: int = 1
) -> Echoes:  # fmt: skip
    trunk = np.tile(np.array(at), (n, 1))
    heading = np.full(n, math.radians(heading_deg))
    return echoes(trunk, heading, np.array(walls, np.float64), np.zeros(2), np.random.default_rng(1), acoustics)


def ranges(found: Echoes) -> tuple[float, float]:
    left, right = (found.own_us[0] * 0.5e-6 * SPEED_M_S).tolist()
    return left, right


@pytest.mark.parametrize("distance_m", [0.3, 1.0, 2.5, 4.0])
def test_a_wall_to_the_left_is_heard_at_its_distance(distance_m: float) -> None:
    wall = [[-5.0, distance_m, 5.0, distance_m]]
    left, right = ranges(listen(wall))
    assert left == pytest.approx(distance_m, abs=1e-3)
    assert right == 0.0
    assert ranges(listen(wall, heading_deg=180.0)) == pytest.approx((0.0, distance_m), abs=1e-3)


def test_a_slanted_wall_is_heard_at_the_foot_of_the_perpendicular() -> None:
    slanted = [[-5.0, 2.0 - 5.0 * math.tan(math.radians(15.0)), 5.0, 2.0 + 5.0 * math.tan(math.radians(15.0))]]
    assert ranges(listen(slanted))[0] == pytest.approx(2.0 * math.cos(math.radians(15.0)), abs=1e-3)


def test_a_wall_out_of_the_cone_is_silent() -> None:
    wall = [[-9.0, 2.0, 9.0, 2.0]]
    for turn in (-20.0, 0.0, 20.0):
        assert ranges(listen(wall, heading_deg=turn))[0] == pytest.approx(2.0, abs=1e-3)
    for turn in (-60.0, -45.0, 45.0, 60.0):
        assert ranges(listen(wall, heading_deg=turn))[0] == 0.0


def test_the_cone_is_narrower_far_away() -> None:
    def rim(distance_m: float) -> int:
        wall = [[-9.0, distance_m, 9.0, distance_m]]
        return max(turn for turn in range(60) if ranges(listen(wall, heading_deg=turn))[0] > 0.0)

    near, middle, far = rim(0.8), rim(2.5), rim(5.0)
    assert near > middle > far > 5
    assert near < 50
    assert 25 <= middle <= 35  # half of the 55 degree cone


def test_the_nearest_of_two_walls_wins_and_hides_the_other() -> None:
    assert ranges(listen([[-5.0, 3.0, 5.0, 3.0], [-2.0, 1.5, 2.0, 1.5]]))[0] == pytest.approx(1.5, abs=1e-3)


def test_a_wall_is_heard_through_the_gap_of_a_door() -> None:
    door = [[-5.0, 1.5, -1.2, 1.5], [1.2, 1.5, 5.0, 1.5], [-5.0, 3.0, 5.0, 3.0]]
    assert ranges(listen(door))[0] == pytest.approx(3.0, abs=1e-3)
    shut = [*door, [-1.2, 1.5, 1.2, 1.5]]
    assert ranges(listen(shut))[0] == pytest.approx(1.5, abs=1e-3)


def test_a_near_edge_answers_from_its_own_distance() -> None:
    """Past the end of a wall there is no perpendicular: what is left is the edge, a little farther and off the axis."""
    assert ranges(listen([[0.1, 1.0, 5.0, 1.0]]))[0] == pytest.approx(math.hypot(0.1, 1.0), abs=1e-3)
    assert ranges(listen([[0.1, 3.5, 5.0, 3.5]]))[0] == 0.0  # too weak for that way
    assert ranges(listen([[0.1, 1.0, 5.0, 1.0], [-2.0, 0.6, 2.0, 0.6]]))[0] == pytest.approx(0.6, abs=1e-3)


def test_nothing_is_heard_nearer_or_farther_than_the_ranger_can() -> None:
    loud = QUIET._replace(threshold_db=-200.0)
    for distance_m, heard in ((0.10, False), (0.16, True), (5.95, True), (6.15, False)):
        found = ranges(listen([[-9.0, distance_m, 9.0, distance_m]], loud))[0]
        assert found == pytest.approx(distance_m if heard else 0.0, abs=1e-3)


def test_echoes_drop_out_near_the_limit() -> None:
    noisy = SRF02._replace(noise_m=0.0)
    shares = [
        (listen([[-9.0, d, 9.0, d]], noisy, n=400, heading_deg=5.0).own_us[:, 0] > 0).mean()
        for d in (2.0, 5.0, 5.5, 5.9, 7.0)
    ]
    assert shares[0] == 1.0
    assert shares[-1] == 0.0
    assert all(a >= b for a, b in itertools.pairwise(shares))


def test_range_errors_have_the_size_of_an_srf02() -> None:
    found = listen([[-9.0, 2.0, 9.0, 2.0]], SRF02, n=2_000).own_us[:, 0] * 0.5e-6 * SPEED_M_S
    heard = found[found > 0]
    assert heard.mean() == pytest.approx(2.0, abs=0.005)
    assert 0.02 < heard.std() < 0.04


def test_parallel_walls_pass_a_ping_to_the_other_ranger() -> None:
    corridor = [[-5.0, 0.7, 5.0, 0.7], [-5.0, -0.6, 5.0, -0.6]]
    found = listen(corridor)
    assert ranges(found) == pytest.approx((0.7, 0.6), abs=1e-3)
    assert np.allclose(found.cross_us[0] * 0.5e-6 * SPEED_M_S, 1.3, atol=1e-3)
    assert not listen(corridor[:1]).cross_us.any()
    assert not listen([corridor[0], [-5.0, -0.6, -0.5, -0.6]]).cross_us.any()
    wide = [[-5.0, 3.5, 5.0, 3.5], [-5.0, -3.5, 5.0, -3.5]]
    assert not listen(wide).cross_us.any()


def test_a_corridor_of_two_metres_passes_pings_to_the_other_ranger() -> None:
    found = listen([[-5.0, 1.0, 5.0, 1.0], [-5.0, -0.8, 5.0, -0.8]])
    assert np.allclose(found.cross_us[0] * 0.5e-6 * SPEED_M_S, 1.8, atol=1e-3)


def test_a_corner_sends_the_ping_back_from_its_apex() -> None:
    """Both walls end there and neither has a perpendicular in the cone: two reflections, the way of the corner itself."""
    corner = [[-3.0, 2.0, 0.3, 2.0], [0.3, 2.0, 0.3, -3.0]]
    turned = listen(corner, at=(-1.5, 0.2), heading_deg=-45.0)  # the left ranger looks at the corner
    assert ranges(turned)[0] == pytest.approx(math.hypot(1.8, 1.8), abs=1e-3)
    assert ranges(listen([corner[0], [0.3, 1.9, 0.3, -3.0]], at=(-1.5, 0.2), heading_deg=-45.0))[0] == 0.0  # leaks


def test_edges_answer_from_outside_a_corner_only() -> None:
    outside = [[0.1, 1.0, 5.0, 1.0], [0.1, 1.0, 0.1, 5.0]]
    assert ranges(listen(outside))[0] == pytest.approx(math.hypot(0.1, 1.0), abs=1e-3)
    assert ranges(listen([[0.1, 1.0, 5.0, 1.0], [-4.0, 1.0, 0.1, 1.0]]))[0] == pytest.approx(1.0, abs=1e-3)
    edges = wall_edges(
        np.array([[0.0, 0.0, 1.0, 0.0], [1.0, 0.0, 2.0, 0.0], [1.5, 0.0, 1.5, 1.0], [2.0, 0.0, 2.0, 1.0]])
    )
    assert sorted((x, y) for x, y, *_ in edges.tolist()) == [(0.0, 0.0), (1.5, 1.0), (2.0, 0.0), (2.0, 1.0)]


def test_levels_are_those_of_the_data_sheet() -> None:
    a = SRF02
    assert directivity_db(math.radians(27.5), a.size) == pytest.approx(-6.0, abs=0.05)
    assert directivity_db(math.radians(70.0), a.size) < -100.0
    assert wall_db(1.0, 0.0, a) == pytest.approx(0.0, abs=1e-9)
    assert wall_db(6.0, 0.0, a) == pytest.approx(a.threshold_db, abs=0.1)
    assert wall_db(2.0, 0.0, a) == pytest.approx(-20.0 * math.log10(2.0) - 2.0 * a.absorption_db_m, abs=1e-9)
    assert rod_db(1.0, 0.0, 1e6, a) == pytest.approx(wall_db(1.0, 0.0, a), abs=1e-3)  # a rod of that size is a wall
    assert rod_db(1.0, 0.0, PIPE_RADIUS_M, a) == pytest.approx(-15.7, abs=0.1)
    assert speed_of_sound_m_s(20.0) == pytest.approx(343.2, abs=0.05)


def test_a_door_shows_while_one_walks_along_a_corridor() -> None:
    """The range jumps from the wall to the room behind when the door comes abeam, and back [Girard 2011, Figure 5b]."""
    x = np.linspace(-3.0, 3.0, 600)
    walls = np.array([[-5.0, 1.0, -0.8, 1.0], [0.8, 1.0, 5.0, 1.0], [-5.0, 4.0, 5.0, 4.0]])
    found = echoes(np.column_stack([x, 0.0 * x]), 0.0 * x, walls, np.zeros(2), np.random.default_rng(1), QUIET)
    range_m = found.own_us[:, 0] * 0.5e-6 * SPEED_M_S
    assert np.allclose(range_m[np.abs(x) > 0.85], 1.0, atol=1e-3)
    assert np.allclose(range_m[np.abs(x) < 0.1], 4.0, atol=1e-3)


@given(st.floats(-3.0, 3.0), st.floats(0.3, 1.6), st.floats(-20.0, 20.0), st.floats(-math.pi, math.pi))
def test_echoes_do_not_depend_on_the_maps_orientation(x: float, y: float, heading_deg: float, turn: float) -> None:
    walls = np.array([[-5.0, 2.0, 5.0, 2.0], [-5.0, -0.3, 5.0, -0.3]])
    c, s = math.cos(turn), math.sin(turn)
    r = np.array([[c, -s], [s, c]])
    at, heading = np.array([[x, y]]), np.array([math.radians(heading_deg)])
    here = echoes(at, heading, walls, np.zeros(2), np.random.default_rng(1), QUIET)
    there = echoes(
        at @ r.T,
        heading + turn,
        (walls.reshape(-1, 2) @ r.T).reshape(-1, 4),
        np.zeros(2),
        np.random.default_rng(1),
        QUIET,
    )
    assert np.abs(here.own_us.astype(int) - there.own_us).max() <= 1
    assert np.abs(here.cross_us.astype(int) - there.cross_us).max() <= 1


def test_no_walls_no_echoes() -> None:
    found = echoes(np.zeros((5, 2)), np.zeros(5), np.zeros((0, 4)), np.zeros(2), np.random.default_rng(1), SRF02)
    assert not found.own_us.any()
    assert not found.cross_us.any()


# Rows


def test_a_row_has_the_layout_of_the_bench() -> None:
    """The fields of host/DESIGN.md, one after the other without gaps."""
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


# The Python board


def rows_of(n: int, own_us: tuple[int, int] = (5_831, 7_000), cross_us: tuple[int, int] = (0, 0)) -> NDArray[Any]:
    rows = np.zeros(n, ROW)
    rows["own_us"], rows["cross_us"] = own_us, cross_us
    rows["thigh"], rows["calf"], rows["belt"] = 41, -82, 5
    rows["bearing"], rows["pressure"], rows["temperature"] = 900, 405_296, 400
    rows["sync_us"] = NO_SYNC
    rows["sync_us"][::10] = 333
    return rows


def heard(sent: list[tuple[int, bytes]], reader: BoardReader | None = None) -> list[m.Message]:
    reader = reader or BoardReader()
    found = [x for _, part in sent for x in reader.feed(part)]
    assert reader.counts.rejected == reader.counts.lost == 0
    return found


def test_the_python_board_sends_every_stream_at_its_rate() -> None:
    found = heard(PythonBoard(seed=1).advance(rows_of(10_000)))
    count = Counter(type(x).__name__ for x in found)
    assert isinstance(found[0], m.Identity)
    assert isinstance(found[1], m.Configuration)
    assert count["Ping"] >= 280
    assert abs(count["Gyros"] - 2_000) <= 2
    assert abs(count["Sync"] - 1_000) <= 2
    assert abs(count["Compass"] - 100) <= 2
    assert abs(count["Pressure"] - 90) <= 2
    assert 9 <= count["Status"] <= 10
    rates = [x[1:] for x in found if isinstance(x, m.Gyros)]
    assert set(rates[:112]) == {(-32768, -32768, -32768)}  # the self-test
    assert set(rates[112:]) == {(41, -82, 5)}
    assert {x[1:] for x in found if isinstance(x, m.GyroHealth)} == {
        (gyro, -34, m.SelfTest.PASSED, -221, 221) for gyro in m.Gyro
    }
    assert {x.time_of_flight_us for x in found if isinstance(x, m.Ping) and x.ranger == m.Ranger.LEFT} == {5_831}
    assert [x.edge for x in found if isinstance(x, m.Sync)][:3] == [0, 1, 2]
    assert {x.ticks % 20_000 for x in found if isinstance(x, m.Sync)} == {666}


def test_concurrent_pings_are_jittered_and_a_cycle_apart() -> None:
    found = [x for x in heard(PythonBoard(seed=1).advance(rows_of(10_000))) if isinstance(x, m.Ping)]
    for ranger in m.Ranger:
        gaps = np.diff([x.ticks for x in found if x.ranger == ranger]) / 2_000
        assert gaps.min() >= 60.0
        assert gaps.max() <= 80.0
        assert gaps.std() > 0.3


def test_commands_are_answered_and_obeyed() -> None:
    board, reader = PythonBoard(seed=1), BoardReader()
    heard(board.advance(rows_of(100)), reader)
    wanted = m.Configure(
        m.Sensors.RANGER_LEFT | m.Sensors.SYNC, m.Schedule.SEQUENTIAL, 250, 99, m.PressureMode.HIGH_RESOLUTION
    )
    board.send(encode(m.Identify(), 0) + encode(m.ClockQuery(0x1234), 1) + encode(wanted, 2))
    found = heard(board.advance(rows_of(20)), reader)
    assert any(isinstance(x, m.Identity) for x in found)
    assert [x.token for x in found if isinstance(x, m.ClockReply)] == [0x1234]
    assert [x for x in found if isinstance(x, m.Configuration)][-1][1:] == (wanted.sensors, 1, 200, 20, 1)
    heard(board.advance(rows_of(200)), reader)
    later = heard(board.advance(rows_of(3_000)), reader)
    assert {type(x) for x in later} == {m.Ping, m.Sync, m.Identity, m.Status}
    assert {x.ranger for x in later if isinstance(x, m.Ping)} == {m.Ranger.LEFT}


def test_sequential_pings_take_turns_every_seventy_milliseconds() -> None:
    board, reader = PythonBoard(seed=1), BoardReader()
    board.send(encode(m.Configure(0xFF, m.Schedule.SEQUENTIAL, 100, 5, 0), 0))
    heard(board.advance(rows_of(500)), reader)
    found = [x for x in heard(board.advance(rows_of(3_000)), reader) if isinstance(x, m.Ping)]
    assert 40 <= len(found) <= 44
    assert all(a.ranger != b.ranger for a, b in itertools.pairwise(found))
    assert all(abs(b.ticks - a.ticks - 140_000) < 8_000 for a, b in itertools.pairwise(found))


def test_the_other_rangers_echo_counts_when_it_comes_first() -> None:
    """It moves with the jitter between the triggers; the own echo does not [host/DESIGN.md, the bench]."""
    none = {x.outcome for x in heard(PythonBoard(seed=1).advance(rows_of(2_000, (0, 0)))) if isinstance(x, m.Ping)}
    assert none == {m.Outcome.NO_ECHO}
    late_us = 30_000  # of the left ranger's ping at the right one, and the other way round
    found = [
        x
        for x in heard(PythonBoard(seed=1).advance(rows_of(10_000, (0, 0), (40_000, 40_000))))
        if isinstance(x, m.Ping)
    ]
    triggers = {r: np.array([x.ticks for x in found if x.ranger == r]) / 2 for r in m.Ranger}
    crossed = [x for x in found if x.outcome == m.Outcome.ECHO]
    assert crossed
    for ping in crossed:
        came_us = ping.ticks / 2 + ping.time_of_flight_us
        assert np.abs(triggers[m.Ranger(1 - ping.ranger)] + 40_000 - came_us).min() <= 1
    assert np.std([x.time_of_flight_us for x in crossed]) > 500
    own = [
        x
        for x in heard(PythonBoard(seed=1).advance(rows_of(5_000, (900, 900), (late_us, late_us))))
        if isinstance(x, m.Ping)
    ]
    assert {x.time_of_flight_us for x in own} == {900}


@given(st.lists(st.binary(max_size=40), max_size=5))
def test_noise_from_the_host_does_no_harm(noise: list[bytes]) -> None:
    board = PythonBoard(seed=1)
    for part in noise:
        board.send(part)
    board.send(b"\0" + encode(m.ClockQuery(7), 0))
    assert any(isinstance(x, m.ClockReply) for x in heard(board.advance(rows_of(5))))


def test_the_python_board_has_no_fault_switches() -> None:
    with pytest.raises(EchostepError, match="srf_left=nack"):
        PythonBoard().fault("srf_left=nack")


# A board in a child process

ECHO_BOARD = (
    f"SIZE = {ROW.itemsize}"
    + """
import sys
def take(n):
    b = sys.stdin.buffer.read(n)
    if len(b) < n: sys.exit(0)
    return b
t = 0
while True:
    head = take(5)
    body = take(int.from_bytes(head[1:], "little"))
    if head[:1] == b"Q": sys.exit(0)
    if head[:1] == b"R": t += len(body) // SIZE * 1000000
    stamp = t.to_bytes(8, "little")
    for kind, out in ((b"B", b"hello"), (b"T", b"trigger left"), (b"A", b"")) if head[:1] == b"R" else ():
        sys.stdout.buffer.write(kind + (8 + len(out)).to_bytes(4, "little") + stamp + out)
    sys.stdout.buffer.flush()
"""
)


def test_a_board_process_advances_in_lockstep() -> None:
    board = BoardProcess([sys.executable, "-c", ECHO_BOARD])
    try:
        board.send(b"from the host")
        assert board.advance(rows_of(50)) == [(50_000_000, b"hello")]
        assert board.advance(rows_of(10)) == [(60_000_000, b"hello")]
        assert board.trace == [(50_000_000, "trigger left"), (60_000_000, "trigger left")]
    finally:
        board.close()


@pytest.mark.parametrize(
    "program",
    [
        "import sys; sys.exit(3)",
        "print('hello, this is no board' * 9)",
        "import sys; sys.stdin.buffer.read(5); sys.exit(0)",
    ],
)
def test_a_board_that_fails_is_named(program: str) -> None:
    board = BoardProcess([sys.executable, "-c", program])
    try:
        with pytest.raises(EchostepError, match="python"):
            board.advance(rows_of(10))
    finally:
        board.close()


def test_a_board_that_hangs_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("echostep.simulation.devices.board.TIMEOUT_S", 0.5)
    board = BoardProcess([sys.executable, "-c", "import sys; sys.stdin.buffer.read()"])
    try:
        with pytest.raises(EchostepError, match="did not answer"):
            board.advance(rows_of(10))
    finally:
        board.close()


@pytest.mark.parametrize("command", [[], ["/no/such/board"]])
def test_a_board_that_cannot_start_is_named(command: list[str]) -> None:
    with pytest.raises(EchostepError, match="cannot start"):
        BoardProcess(command)


# The whole scenario


def test_equal_seeds_give_equal_chunks_in_order(plan: Plan) -> None:
    def run(seed: int) -> list[Chunk]:
        return list(Scenario(plan, ((2.0, 7.5), (9.0, 7.5)), seed, PythonBoard(seed)).chunks())

    first, again, other = run(1), run(1), run(2)
    assert first == again
    assert first != other
    times = [chunk.t_arrival_ns for chunk in first]
    assert times == sorted(times)
    assert {chunk.port for chunk in first} == {BOARD, MTX}
    assert max(len(chunk.data) for chunk in first if chunk.port == MTX) < 59  # cut by the adapter's timer of 1 ms
    reader, mtx_reader = BoardReader(), MtxReader()
    for chunk in first:
        (reader if chunk.port == BOARD else mtx_reader).feed(chunk.data)
    assert reader.counts.rejected == reader.counts.lost == 0
    assert mtx_reader.counts.lost == mtx_reader.counts.skipped_bytes == mtx_reader.counts.bad_checksum == 0


def test_a_configuration_reaches_the_board(plan: Plan) -> None:
    wanted = m.Configure(m.Sensors.RANGER_LEFT, m.Schedule.SEQUENTIAL, 50, 5, m.PressureMode.HIGH_SPEED)
    scenario = Scenario(plan, ((2.0, 7.5), (6.0, 7.5)), 1, PythonBoard(1), configure=wanted)
    reader = BoardReader()
    found = [x for c in scenario.chunks() if c.port == BOARD for x in reader.feed(c.data)]
    assert [x for x in found if isinstance(x, m.Configuration)][-1].sensors == m.Sensors.RANGER_LEFT
    assert not any(isinstance(x, m.Gyros) for x in found)


class Mute:
    """A board whose bytes go elsewhere, as with the twin on a pseudo terminal."""

    def advance(self, rows: NDArray[Any]) -> list[tuple[int, bytes]]:
        self.ms = getattr(self, "ms", 0) + len(rows)
        return []

    def send(self, sent: bytes) -> None: ...
    def fault(self, text: str) -> None: ...
    def close(self) -> None: ...


def test_a_scenario_can_be_paced_without_a_boards_bytes(plan: Plan) -> None:
    board = Mute()
    for chunk in Scenario(plan, ((2.0, 7.5), (6.0, 7.5)), 1, board).chunks():
        assert abs((chunk.t_arrival_ns - 1_000_000_000) * 1e-6 - board.ms) <= 60


def test_each_sample_has_its_sync_edge(plan: Plan) -> None:
    scenario = Scenario(plan, ((2.0, 7.5), (6.0, 7.5)), 1, PythonBoard(1))
    reader = BoardReader()
    found = [x for c in scenario.chunks() if c.port == BOARD for x in reader.feed(c.data) if isinstance(x, m.Sync)]
    ticks_s = np.array([x.ticks for x in found]) * 0.5e-6
    assert np.abs(ticks_s - scenario.mtx.t_s[: len(ticks_s)]).max() < 2e-6


def test_the_demo_walk_passes_no_wall(plan: Plan) -> None:
    """Doors are wide enough, corners are not cut."""
    path = demo_scenario(plan, 1, PythonBoard(1)).walk.trunk_m[::50]
    for x0, y0, x1, y1 in plan.levels[0].walls:
        a, b = np.array([x0, y0]), np.array([x1, y1])
        share = np.clip((path - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
        assert np.hypot(*(path - a - share[:, None] * (b - a)).T).min() > 0.3


def test_the_truth_file_is_the_trunk_at_fifty_hertz(plan: Plan, tmp_path: Any) -> None:
    scenario = Scenario(plan, ((2.0, 7.5), (6.0, 7.5)), 1, PythonBoard(1))
    scenario.write_truth(tmp_path / "truth.csv", 2.0)
    table = np.loadtxt(tmp_path / "truth.csv", delimiter=",", skiprows=1)
    assert (tmp_path / "truth.csv").read_text().startswith("t_s,x,y,heading_rad,z\n")
    assert np.allclose(np.diff(table[:, 0]), 0.02)
    assert table[0] == pytest.approx([2.0, *scenario.walk.trunk_m[0], scenario.walk.heading_rad[0], 0.0], abs=1e-5)
