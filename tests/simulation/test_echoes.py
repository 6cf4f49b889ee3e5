# SPDX-License-Identifier: MIT
"""The simulated echoes of an SRF02."""

from __future__ import annotations

import itertools
import math
from functools import partial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from echostep.arrays import Floats
from echostep_simulation.world.acoustics import (
    PIPE_RADIUS_M,
    SRF02,
    Acoustics,
    directivity_db,
    rod_db,
    speed_of_sound_m_s,
    wall_db,
)
from echostep_simulation.world.echoes import Echoes, echoes
from echostep_simulation.world.image_sources import wall_edges
from simulation.simulated import SPEED_M_S

QUIET = SRF02._replace(noise_m=0.0, threshold_sd_db=0.0)


def listen(
    walls: list[list[float]], acoustics: Acoustics = QUIET, *, at: tuple[float, float] = (0.0, 0.0), heading_deg: float = 0.0, n: int = 1
) -> Echoes:  # fmt: skip
    trunk = np.tile(np.array(at), (n, 1))
    heading = np.full(n, math.radians(heading_deg))
    return echoes(trunk, heading, np.array(walls, np.float64), np.zeros(2), np.random.default_rng(1), acoustics)


def ranges(found: Echoes) -> tuple[float, float]:
    left, right = (found.own_us[0] * 0.5e-6 * SPEED_M_S).tolist()
    return left, right


def polar(x: float, y: float, turn_deg: float, distance_m: float, bearing_deg: float) -> list[float]:
    """The place at this distance and bearing from (x, y) on a map that is turned."""
    angle = math.radians(turn_deg + bearing_deg)
    return [x + distance_m * math.cos(angle), y + distance_m * math.sin(angle)]


def towards(x: float, y: float, place: list[float]) -> float:
    """Heading (degrees) at a place with which the left ranger looks at (x, y)."""
    return math.degrees(math.atan2(y - place[1], x - place[0])) - 90.0


@pytest.mark.parametrize("distance_m", [0.3, 1.0, 2.5, 4.0])
def test_a_wall_to_the_left_is_heard_at_its_distance(distance_m: float) -> None:
    wall = [[-5.0, distance_m, 5.0, distance_m]]
    left, right = ranges(listen(wall))
    assert left == pytest.approx(distance_m, abs=1e-3)
    assert right == 0.0
    assert ranges(listen(wall, heading_deg=180.0)) == pytest.approx((0.0, distance_m), abs=1e-3)


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


def test_a_corner_sends_the_ping_back_from_its_apex() -> None:
    """Both walls end there and neither has a perpendicular in the cone: two reflections, the way of the corner itself."""
    corner = [[-3.0, 2.0, 0.3, 2.0], [0.3, 2.0, 0.3, -3.0]]
    turned = listen(corner, at=(-1.5, 0.2), heading_deg=-45.0)  # the left ranger looks at the corner
    assert ranges(turned)[0] == pytest.approx(math.hypot(1.8, 1.8), abs=1e-3)
    assert ranges(listen([corner[0], [0.3, 1.9, 0.3, -3.0]], at=(-1.5, 0.2), heading_deg=-45.0))[0] == 0.0  # leaks


@given(
    st.floats(-50.0, 50.0), st.floats(-50.0, 50.0), st.floats(0.0, 360.0), st.floats(40.0, 50.0), st.floats(2.0, 4.0)
)
def test_a_right_angled_corner_answers_wherever_the_map_begins(
    x: float, y: float, turn_deg: float, bearing_deg: float, away_m: float
) -> None:
    """Both walls reflect at the end where they meet; a wall that goes on beyond the corner changes nothing."""
    at = partial(polar, x, y, turn_deg)
    place = at(away_m, bearing_deg)
    looking = towards(x, y, place)
    for beyond_m in (0.0, 3.0):
        walls = [[*at(beyond_m, 180.0), *at(6.0, 0.0)], [*at(0.0, 90.0), *at(6.0, 90.0)]]
        left, _ = ranges(listen(walls, at=(place[0], place[1]), heading_deg=looking))
        assert left == pytest.approx(away_m, abs=2e-3)


@given(st.floats(-50.0, 50.0), st.floats(-50.0, 50.0), st.floats(0.0, 360.0), st.floats(5.0, 40.0), st.floats(2.0, 4.0))
def test_from_outside_a_corner_does_not_send_the_ping_back(
    x: float, y: float, turn_deg: float, bearing_deg: float, away_m: float
) -> None:
    """Along a wall, behind which another one ends (T), or which ends at a door (L): nothing there faces the ranger; the edge is too far."""
    at = partial(polar, x, y, turn_deg)
    place = at(away_m, 180.0 - bearing_deg)
    looking = towards(x, y, place)
    # The wall's own perpendicular is out of the cone.
    for beyond_m in (0.0, 3.0):
        walls = [[*at(5.0, 180.0), *at(beyond_m, 0.0)], [*at(0.0, 270.0), *at(4.0, 270.0)]]
        assert ranges(listen(walls, at=(place[0], place[1]), heading_deg=looking))[0] == 0.0


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


def lengths(found: Echoes) -> Floats:
    """Ranges (n,) of the left ranger."""
    metres: Floats = found.own_us[:, 0].astype(np.float64) * (0.5e-6 * SPEED_M_S)
    return metres


def shares_of(found: Echoes, ways_m: list[float]) -> list[float]:
    """Share of the pings at each of these ranges, of the left ranger."""
    return [float(np.mean(np.abs(lengths(found) - way) < 2e-3)) for way in ways_m]


def two_walls(heading_deg: float, acoustics: Acoustics) -> Echoes:
    """Pings between two walls that do not quite meet, so that nothing comes back by both."""
    walls = [[-1.4, 2.0, 1.5, 2.0], [-1.5, -2.0, -1.5, 1.6]]
    return listen(walls, acoustics, heading_deg=heading_deg, n=2_000)


def test_a_beam_that_a_wall_turns_away_is_scattered_where_it_meets_walls() -> None:
    """At 30 degrees the left ranger's beam goes by (-1.155, 2) and (-1.5, 1.402): 2.309 and 3.0 m."""
    deaf_to_slants = QUIET._replace(size=20.0)  # hears walls within 11 degrees
    assert (two_walls(30.0, deaf_to_slants).own_us == 0).all()
    found = two_walls(30.0, deaf_to_slants._replace(scatter=0.35))
    shares = shares_of(found, [2.309, 3.0])
    assert shares == pytest.approx([0.35, 0.65 * 0.35], abs=0.03)
    assert np.mean(lengths(found) == 0.0) == pytest.approx(1.0 - sum(shares), abs=1e-9)


def test_an_echo_by_a_mirror_is_not_scattered() -> None:
    assert lengths(two_walls(0.0, QUIET._replace(scatter=0.9))) == pytest.approx(2.0, abs=1e-3)


def test_a_share_of_first_echoes_is_missed_and_the_next_is_reported() -> None:
    """The next comes from the same wall by way of the wearer, or from behind what was missed; out of hearing it is none."""
    missing = QUIET._replace(missed=0.2)
    near, far = [[-5.0, 1.0, 5.0, 1.0]], [[-5.0, 4.0, 5.0, 4.0]]
    assert shares_of(listen(near, missing, n=2_000), [1.0, 2.0]) == pytest.approx([0.8, 0.2], abs=0.03)
    assert shares_of(listen(far, missing, n=2_000), [4.0, 0.0]) == pytest.approx([0.8, 0.2], abs=0.03)
    behind = [[-5.0, 1.0, 5.0, 1.0], [0.1, 1.0, 0.1, 0.6]]  # its end at 0.608 m answers first
    assert shares_of(listen(behind, missing, n=2_000), [0.608, 1.0]) == pytest.approx([0.8, 0.2], abs=0.03)


def test_what_is_missed_says_nothing_of_noise_and_shifts_no_other_draw() -> None:
    wall = [[-9.0, 2.0, 9.0, 2.0]]
    sure, missing = (
        lengths(listen(wall, SRF02, n=4_000)),
        lengths(listen(wall, SRF02._replace(missed=0.3), n=4_000)),
    )
    right = np.abs(missing - 2.0) < 0.5
    assert np.mean(right) == pytest.approx(0.7, abs=0.03)
    assert (missing[right] == sure[right]).all()
    assert missing[right].std() == pytest.approx(sure.std(), rel=0.05)
