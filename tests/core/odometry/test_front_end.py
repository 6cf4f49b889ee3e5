# SPDX-License-Identifier: MIT
"""The front end: the chunks alone decide what comes out; what is late, lost or silent is counted or told."""

from __future__ import annotations

import heapq
import math
import random
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from echostep.arrays import Floats, Ints
from echostep.board.calibration import GyroSettings, RangerSettings, ranges
from echostep.board.frames import encode
from echostep.board.messages import ROWS, Outcome, Ping
from echostep.foot.steps import FootSettings
from echostep.foot.trunk_path import GaitSettings
from echostep.legs.trunk_path import GyroBlock
from echostep.odometry import FrontEnd, WearerWatch
from echostep.odometry.synchronizer import BLIND_S, MAX_WAITING, MEASUREMENT, PING_AGE_S, SILENCE_S, Synchronizer
from echostep.path import Dropout, MeasuredSegment, PathSegment
from echostep.ports.chunks import BOARD, MTX, Chunk, portion_of
from echostep.timing.timeline import MtxTiming
from echostep_simulation.devices.board import PythonBoard
from echostep_simulation.devices.mtx import MtxModel
from echostep_simulation.scenario import DEMO_WAYPOINTS, Scenario
from walks import PLAN

Told = list[tuple[object, ...]]
CORRECTED = 25_000  # chunks


@cache
def recorded() -> list[Chunk]:
    """A short walk whose foot is held up for a while and later falls silent, with damage on both ports and a port that nobody knows."""
    rng = random.Random(8)
    chunks = []
    for n, chunk in enumerate(Scenario(PLAN, ((2.0, 7.5), (9.5, 7.5)), 5, PythonBoard(5)).chunks()):
        if chunk.port == MTX and 6_000_000_000 < chunk.t_arrival_ns < 8_500_000_000:
            continue
        if chunk.port == MTX and 3_000_000_000 < chunk.t_arrival_ns < 5_000_000_000:
            chunk = replace(chunk, t_arrival_ns=5_000_000_000)
        damaged = bytearray(chunk.data)
        if rng.random() < 0.01:
            damaged[rng.randrange(len(damaged))] = rng.choice([0, 0xFA, 0xFF, 0x32])
        chunks.append(replace(chunk, data=bytes(damaged)))
        if n % 1000 == 0:
            chunks.append(Chunk("kettle", chunk.t_arrival_ns, b"?"))
    return sorted(chunks, key=lambda chunk: chunk.t_arrival_ns)


def front_end() -> FrontEnd:
    return FrontEnd(MtxTiming(), RangerSettings(), FootSettings(), GaitSettings())


def told(pieces: list[MeasuredSegment | Dropout]) -> Told:
    """Pieces as tuples, every bit of them."""
    found: Told = []
    for piece in pieces:
        if isinstance(piece, MeasuredSegment):
            found.append((piece.segment, piece.t_s.tobytes(), piece.ranger.tobytes(), piece.range_m.tobytes()))
        else:
            found.append((piece.t_s,))
    return found


class Heard(WearerWatch):
    """All that a watch over the wearer is told, as bytes."""

    def __init__(self) -> None:
        self.told: dict[str, list[bytes]] = defaultdict(list)

    def add_foot(self, t_s: Floats, gyro: Floats, accel: Floats, _message_index: Ints) -> None:
        for name, values in (("t_s", t_s), ("gyro", gyro), ("accel", accel)):
            self.told[f"foot {name}"].append(values.tobytes())

    def add_legs(self, _message_index: int, block: GyroBlock) -> None:
        for name, values in zip(block._fields, block, strict=True):
            self.told[f"legs {name}"].append(np.asarray(values).tobytes())

    def add_segments(self, _message_index: int, segments: Sequence[PathSegment]) -> None:
        self.told["segments"] += [repr(segment).encode() for segment in segments]


def taken(chunks: list[Chunk], cuts: list[int]) -> tuple[Told, tuple[object, ...]]:
    """What a front end tells of the chunks, in portions cut there, and what it counted."""
    ours, watch, found = front_end(), Heard(), []
    ours.watch = watch
    edges = sorted({0, len(chunks), *(c % (len(chunks) + 1) for c in cuts)})
    for a, b in zip(edges, edges[1:], strict=False):
        found += told(ours.process(portion_of(chunks[a:b])))
    return found, (
        ours.counts,
        ours.board.counts,
        ours.foot_source.counts,
        ours.reports,
        ours.timeline.synchronised,
        {name: b"".join(parts) for name, parts in watch.told.items()},
    )


@cache
def whole() -> tuple[Told, tuple[object, ...]]:
    """What the recorded walk gives in one portion."""
    return taken(recorded(), [])


def test_the_recorded_walk_has_all_that_matters() -> None:
    kinds = {len(piece) for piece in whole()[0]}
    assert kinds == {1, 4}
    ours = front_end()
    pieces = ours.process(portion_of(recorded()))
    passages = [piece for piece in pieces if isinstance(piece, MeasuredSegment)]
    assert sum(len(p.t_s) for p in passages) > 200
    assert any(p.segment.unobserved for p in passages)
    assert ours.counts.unknown_ports > 5
    assert ours.board.counts.rejected > 10
    assert ours.foot_source.counts.bad_checksum > 5
    assert ours.reports.status is not None
    assert ours.reports.identity is not None


@pytest.mark.slow
@given(st.lists(st.integers(0, 1 << 20), max_size=40))
@settings(max_examples=25, deadline=None)
def test_any_portions_tell_the_same(cuts: list[int]) -> None:
    assert taken(recorded(), cuts) == whole()


@pytest.mark.long
@given(st.integers(0, 1 << 32), st.lists(st.integers(0, 1 << 20), max_size=10))
@settings(max_examples=25, deadline=None)
def test_bytes_that_arrived_together_may_be_cut_anywhere(seed: int, cuts: list[int]) -> None:
    rng = random.Random(seed)
    finer = []
    for chunk in recorded():
        at = rng.randrange(len(chunk.data) + 1)
        finer += (
            [replace(chunk, data=part) for part in (chunk.data[:at], chunk.data[at:])]
            if chunk.port != "kettle"
            else [chunk]
        )
    assert taken(finer, cuts) == whole()


def test_pings_without_a_foot_are_bounded_and_counted() -> None:
    ours = front_end()
    sent = MAX_WAITING + 500
    chunks = [
        Chunk(BOARD, n * 10_000_000, encode(Ping(n * 20_000, n % 2, Outcome.ECHO, 5_000), n)) for n in range(sent)
    ]
    assert ours.process(portion_of(chunks)) == []
    assert ours.counts.dropped_pings == 500


def test_ranges_of_pings() -> None:
    rows = [
        (0, 0, Outcome.ECHO, 10_000),
        (0, 1, Outcome.NO_ECHO, 0),
        (0, 0, Outcome.ECHO, 0),
        (0, 1, Outcome.NO_ECHO, 7),
    ]
    found = ranges(np.array(rows, ROWS[0x02]), RangerSettings(speed_of_sound_m_s=340.0))
    assert found[0] == pytest.approx(1.7)
    assert np.isnan(found[1:]).all()


def test_a_setting_of_a_bias_is_taken_off_each_ranger_s_own_ranges() -> None:
    """2000 and 20 us are 0.343 and 0.003 m; what is shorter than a centimetre stays."""
    flights = [(0, 2000), (1, 2000), (0, 20), (0, 100)]
    pings = np.array([(0, ranger, Outcome.ECHO, flight_us) for ranger, flight_us in flights], ROWS[0x02])
    biased = RangerSettings(left_bias_m=0.05, right_bias_m=-0.02)
    usual, own = ranges(pings, RangerSettings()), ranges(pings, biased)
    assert own - usual == pytest.approx([-0.05, 0.02, 0.0, 0.01 - usual[3]])


class NaiveWaiting:
    """Slow, obviously right: a heap, and one message after the other."""

    def __init__(self) -> None:
        self.late = self.dropped = self._pushed = 0
        self._pings: list[tuple[float, int, tuple[float, float, float]]] = []
        self._legs: list[PathSegment] = []
        self._gone_s, self._told_s, self._gone = 0.0, -math.inf, 0

    def message(
        self, pings: list[tuple[float, float, float]], legs: list[PathSegment], board_s: float, mtx_s: float
    ) -> list[tuple[object, ...]]:
        found: list[tuple[object, ...]] = []
        for ping in pings:
            self._push(ping)
        self._legs += legs
        complete = max(t for t in (board_s - PING_AGE_S, mtx_s - SILENCE_S, -math.inf) if not math.isnan(t))
        while self._legs and self._legs[0].t1_s <= complete:
            leg, heard = self._legs.pop(0), []
            while self._pings and self._pings[0][0] <= leg.t1_s:
                heard.append(heapq.heappop(self._pings)[2])
            self._gone_s, self._gone = max(self._gone_s, leg.t1_s), self._gone + 1
            found.append((leg, heard))
        if self._gone and board_s - max(mtx_s, self._told_s) >= BLIND_S:
            self._told_s = board_s
            found.append((board_s,))
        return found

    def _push(self, ping: tuple[float, float, float]) -> None:
        if ping[0] < self._gone_s:
            self.late += 1
            return
        heapq.heappush(self._pings, (ping[0], self._pushed, ping))
        self._pushed += 1
        if len(self._pings) > MAX_WAITING:
            heapq.heappop(self._pings)
            self.dropped += 1


def leg(t0_s: float, t1_s: float) -> PathSegment:
    return PathSegment(t0_s, t1_s, 0.1, 0.0, 0.0, 0.0, 0.01, 0.001, 1)


@given(st.integers(0, 1 << 32), st.lists(st.integers(0, 400), max_size=5), st.sampled_from([0.0, 0.2, 3.0]))
@settings(max_examples=60, deadline=None)
def test_waiting_is_like_its_naive_twin(seed: int, cuts: list[int], age_s: float) -> None:
    rng = np.random.default_rng(seed)
    naive, ours, end_s = NaiveWaiting(), Synchronizer(), 0.0
    n = 400
    board = np.where(np.arange(n) < 5, np.nan, np.cumsum(rng.exponential(0.05, n)))
    mtx = np.where(
        np.arange(n) < 9,
        np.nan,
        np.minimum(board + rng.normal(0.0, rng.choice([0.1, 1.0]), n), rng.choice([5.0, 99.0])),
    )
    pings: list[list[tuple[float, float, float]]] = []
    legs: list[list[PathSegment]] = []
    for k in range(n):
        told_now = not np.isnan(board[k]) and rng.random() < 0.4
        age = age_s * rng.random()
        pings.append([(round(float(board[k] - age), 2), float(k % 2), float(rng.random()))] if told_now else [])
        legs.append([])
        if not np.isnan(mtx[k]) and mtx[k] > end_s + 0.3:
            legs[-1].append(leg(end_s, float(mtx[k]) + 0.2))
            end_s = float(mtx[k]) + 0.2
    expected = [x for k in range(n) for x in naive.message(pings[k], legs[k], float(board[k]), float(mtx[k]))]
    found: list[tuple[object, ...]] = []
    edges = sorted({0, n, *cuts})
    for a, b in zip(edges, edges[1:], strict=False):
        at = [k - a for k in range(a, b) for _ in pings[k]]
        new = np.zeros(len(at), MEASUREMENT)
        new[["t_s", "source", "value_m"]] = [p for k in range(a, b) for p in pings[k]]
        ours.add_pings(np.array(at, np.int64), new)
        for k in range(a, b):
            ours.add_segments(k - a, legs[k])
        for piece in ours.pop_ready(board[a:b], mtx[a:b], mtx[a:b]):
            if isinstance(piece, MeasuredSegment):
                heard = zip(piece.t_s.tolist(), piece.ranger.tolist(), piece.range_m.tolist(), strict=True)
                found.append((piece.segment, list(heard)))
            else:
                found.append((piece.t_s,))
    assert found == expected
    assert (ours.late, ours.dropped) == (naive.late, naive.dropped)


def test_the_rangers_delay_moves_their_pings() -> None:
    late = FrontEnd(MtxTiming(), RangerSettings(delay_s=0.01), FootSettings(), GaitSettings())
    times = [
        np.concatenate(
            [piece.t_s for piece in ours.process(portion_of(recorded())) if isinstance(piece, MeasuredSegment)]
        )
        for ours in (front_end(), late)
    ]
    both = min(map(len, times)) - 10
    assert np.allclose(times[1][:both] - times[0][:both], 0.01)


@cache
def drifting(drift_deg: float) -> tuple[Chunk, ...]:
    """Four minutes through the demo's building with a foot whose yaw walks by so much per root metre, and a belt's gyro."""
    model = MtxModel(yaw_walk_rad=math.radians(drift_deg))
    return tuple(Scenario(PLAN, 3 * DEMO_WAYPOINTS, 4, PythonBoard(4), None, model).chunks())


def headings(chunks: Iterable[Chunk], portion: int, ours: FrontEnd | None = None) -> list[tuple[float, float]]:
    """Time and heading at the end of each segment."""
    ours, given = ours or front_end(), list(chunks)
    portions = (portion_of(given[k : k + portion]) for k in range(0, len(given), portion))
    pieces = [piece for p in portions for piece in ours.process(p)]
    return [(p.segment.t1_s, p.segment.heading1_rad) for p in pieces if isinstance(p, MeasuredSegment)]


@pytest.mark.long
def test_the_belts_gyro_takes_drift_out_of_the_foot() -> None:
    """By the headings of a foot without drift. With a belt gyro upside down the foot is alone."""
    foot_alone = FrontEnd(
        MtxTiming(), RangerSettings(), FootSettings(), GaitSettings(), gyro=GyroSettings(belt_reversed=True)
    )
    true, fused = (np.array(headings(drifting(deg), 1000)) for deg in (0.0, 1.0))
    alone = np.array(headings(drifting(1.0), 1000, foot_alone))
    assert foot_alone.heading_fusion.correction_rad == 0.0
    t_s = np.arange(90.0, true[-1, 0] - 1.0)
    grown = []
    for track in (fused, alone):
        error = np.interp(t_s, *_unwrapped(track)) - np.interp(t_s, *_unwrapped(true))
        grown.append(float(np.mean((error[40:] - error[:-40]) ** 2)))
    assert math.sqrt(grown[0] / grown[1]) < 0.9


def _unwrapped(track: Floats) -> Floats:
    return np.array([track[:, 0], np.unwrap(track[:, 1])])


@cache
def corrected() -> list[tuple[float, float]]:
    """The headings of a part of that walk in which the belt's gyro corrects them."""
    ours = front_end()
    found = headings(drifting(1.0)[:CORRECTED], 1000, ours)
    assert abs(ours.heading_fusion.correction_rad) > 1e-3
    return found


@pytest.mark.long
@pytest.mark.parametrize("portion", [1, 37, 20_000])
def test_corrected_headings_do_not_depend_on_portions(portion: int) -> None:
    assert headings(drifting(1.0)[:CORRECTED], portion) == corrected()
