# SPDX-License-Identifier: MIT
"""The beacon gateway: hostile bytes are counted and named, beacons find their place in the map filter, live and replay agree."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from echostep.board.frames import encode
from echostep.board.gateway import MOST_BEACONS, NEW_CLOCK_MESSAGES, Gateway
from echostep.board.messages import Beacon, Identity
from echostep.ports.chunks import BOARD, GATEWAY, Chunk, portion_of
from echostep_simulation.devices.beacon_gateway import BeaconWorld, gateway_chunks, heard_at, lay_beacons, message

GOOD = message(7, 3.25, 0.5, 10.0)


def said(gateway: Gateway, *beacons: Beacon, now_s: float = 10.0) -> list[tuple[float, int, float, float]]:
    return [tuple(w) for b in beacons for w in gateway.read(encode(b, 0), now_s)]  # type: ignore[misc]


def test_a_word_is_on_the_trackers_time() -> None:
    ((t_s, slot, range_m, bearing_rad),) = said(Gateway(), GOOD._replace(age_ms=250))
    assert (t_s, slot, range_m) == (9.75, 0, 3.25)
    assert bearing_rad == pytest.approx(0.5, abs=1e-4)


def test_bearing_may_be_missing() -> None:
    assert math.isnan(said(Gateway(), GOOD._replace(bearing=-32768))[0][3])


@pytest.mark.parametrize(
    ("wrong", "count"),
    [
        ({"range_mm": 65535}, "impossible_ranges"),
        ({"range_mm": 0}, "impossible_ranges"),
        ({"range_mm": 45_000}, "impossible_ranges"),
        ({"bearing": 18_001}, "impossible_bearings"),
        ({"age_ms": 5_000}, "late"),
    ],
)
def test_impossible_words_are_counted(wrong: dict[str, int], count: str) -> None:
    gateway = Gateway()
    assert said(gateway, GOOD._replace(**wrong)) == []
    assert getattr(gateway.counts, count) == 1


def test_words_before_the_tracker_has_a_time_are_not_guessed() -> None:
    gateway = Gateway()
    assert said(gateway, GOOD, now_s=math.nan) == []
    assert gateway.counts.early == 1


def test_second_unit_under_a_number_is_refused() -> None:
    gateway = Gateway()
    assert len(said(gateway, GOOD)) == 1
    assert said(gateway, GOOD._replace(unit=1), now_s=10.2) == []
    assert gateway.duplicates == {7}


def test_a_beacon_that_speaks_too_often_is_a_flood_and_others_are_still_heard() -> None:
    gateway = Gateway()
    stream = b"".join(encode(GOOD, k) for k in range(10_000)) + encode(message(8, 2.0, 0.0, 10.0), 10_000)
    words = gateway.read(stream, 10.0)
    assert [w.slot for w in words] == [0, 1]
    assert gateway.counts.flood == 9_999


def test_more_beacons_than_are_known_are_counted() -> None:
    gateway = Gateway()
    assert len(said(gateway, *(message(k, 2.0, 0.0, 10.0) for k in range(MOST_BEACONS + 5)))) == MOST_BEACONS
    assert gateway.counts.too_many == 5


def test_clock_that_jumps_is_doubted_until_it_is_steady() -> None:
    gateway = Gateway()
    assert len(said(gateway, GOOD)) == 1
    accepted = [len(said(gateway, message(7, 3.0, 0.0, 500.0 + 0.2 * k), now_s=10.2 + 0.2 * k)) for k in range(15)]
    assert accepted == [0] * (NEW_CLOCK_MESSAGES - 1) + [1] * (15 - NEW_CLOCK_MESSAGES + 1)
    assert gateway.counts.clock_jumps == 1
    assert gateway.counts.late == NEW_CLOCK_MESSAGES - 1


def test_frames_of_a_board_at_the_gateways_port_are_foreign() -> None:
    gateway = Gateway()
    assert gateway.read(encode(Identity(0, 0x12345678, 0, 0, 0, 0), 0) + b"\0", 1.0) == []
    assert gateway.counts.foreign == 1
    assert len(said(gateway, GOOD)) == 1


@given(st.lists(st.binary(max_size=80), max_size=20))
@settings(max_examples=50)
def test_any_bytes_leave_the_next_word_readable(noise: list[bytes]) -> None:
    gateway = Gateway()
    for part in noise:
        gateway.read(part, 10.0)
    gateway.read(b"\0", 10.0)
    assert len(said(gateway, GOOD)) == 1


def test_walls_hide_beacons() -> None:
    rng = np.random.default_rng(1)
    wall = np.array([[1.0, -5.0, 1.0, 5.0]])
    assert list(heard_at(BeaconWorld(np.array([[2.0, 0.0, 0.0]]), wall), 0.0, 0.0, rng)) == []
    assert len(list(heard_at(BeaconWorld(np.array([[2.0, 12.0, 0.0]]), wall, 20.0), 0.0, 0.0, rng))) == 1


def test_simulated_chunks_are_repeatable() -> None:
    t_s, xy = np.arange(0.0, 10.0, 0.02), np.column_stack([np.arange(0.0, 10.0, 0.02), np.zeros(500)])
    world = BeaconWorld(lay_beacons(xy, 5.0, np.random.default_rng(1)), np.zeros((0, 4)))
    arrival = np.rint(1e9 * t_s).astype(np.int64)
    one, two = (list(gateway_chunks(world, t_s, xy, arrival, 3)) for _ in range(2))
    assert one == two
    assert len(one) > 40
    assert all(chunk.port == GATEWAY for chunk in one)


def test_portion_is_cut_behind_each_chunk_of_a_port() -> None:
    chunks = [Chunk(p, k, b"%d" % k) for k, p in enumerate((BOARD, GATEWAY, GATEWAY, BOARD, BOARD))]
    pieces = [list(p.chunks()) for p in portion_of(chunks).cut_after(GATEWAY)]
    assert pieces == [chunks[:2], chunks[2:3], chunks[3:]]
    assert [c for p in portion_of(chunks[3:]).cut_after(GATEWAY) for c in p.chunks()] == chunks[3:]
