# SPDX-License-Identifier: MIT
"""The foot board in the twin: the ICM-20649 found, its samples stamped, its ways to fail; nothing else is read."""

from __future__ import annotations

import numpy as np
import pytest

from board_runs import Bench, kinds, needs_twin
from echostep.board import messages as m
from echostep.board.reports import SUBSCRIBE
from echostep_app.board.faults.health import board_findings
from echostep_simulation.stimulus import EXTENDED_ROW, NO_SYNC

pytestmark = needs_twin

RATE_HZ = 225.0
STAMP_US = 20.0  # limit on the error of a stamp
STILL = np.array([[10, -20, 30], [100, -200, 1_024]])  # rates and forces, counts
Rows = np.ndarray[tuple[int], np.dtype[np.void]]


def foot_rows(milliseconds: int) -> Rows:
    """Rows of a foot that stands; temperature 24 degC."""
    rows = np.zeros(milliseconds, EXTENDED_ROW)
    rows["row"]["sync_us"], rows["row"]["temperature"] = NO_SYNC, 480
    rows["motion"]["rate"][:, 0], rows["motion"]["force"][:, 0] = STILL
    return rows


@pytest.fixture
def foot(bench: Bench) -> Bench:
    """A foot board, subscribed."""
    bench.fault("kit=foot")
    bench.subscribe(foot_rows)
    run(bench, 1_200)
    return bench


def run(bench: Bench, milliseconds: int) -> list[m.Message]:
    return bench.run(milliseconds, foot_rows(milliseconds))


def samples(found: list[m.Message]) -> list[m.Foot]:
    return [x for x in found if isinstance(x, m.Foot)]


def health(bench: Bench) -> m.FootHealth:
    return next(x for x in reversed(bench.messages) if isinstance(x, m.FootHealth))


def test_the_part_is_found_and_the_board_becomes_a_foot_board(foot: Bench) -> None:
    found = run(foot, 2_000)
    parts = next(x for x in reversed(found) if isinstance(x, m.Parts))
    assert (parts.part_foot, parts.identity_foot) == (m.Part.ICM20649, 0xE1)
    assert set(parts[1:8]) == {m.Part.NONE}
    assert set(kinds(found)) == {"Foot", "FootHealth", "Identity", "Status", "BoardHealth", "Parts"}
    assert next(x for x in reversed(foot.messages) if isinstance(x, m.Configuration)).sensors == 0
    assert health(foot)[1:] == (m.FootState.RUNNING, m.Fault.NONE, 0, 0, round((24.0 - 21.0) * 333.87))
    assert foot.status.memory_used < 2_200
    first, last = (x._asdict() for x in [y for y in found if isinstance(y, m.Status)][:2])
    counters = [k for k in first if k.startswith(("dropped_", "errors_"))]
    assert [first[k] for k in counters] == [last[k] for k in counters]  # the first moments sought the belt's sensors
    assert board_findings(foot.reports) == []


@pytest.mark.parametrize("undefined", ["zeros", "ones", "noise"])
def test_the_part_is_found_whatever_its_idle_line_reads(bench: Bench, undefined: str) -> None:
    """Its board pulls MISO down against the processor's pull-up. No frame for another part may come before: it would write registers."""
    bench.fault("kit=foot", f"miso_undefined={undefined}")
    bench.subscribe(foot_rows)
    run(bench, 1_000)
    assert len(samples(run(bench, 1_000))) > 220
    assert not [text for _, text in bench.board.trace if "misreads" in text]


@pytest.mark.parametrize("errors", [1, 3])
def test_no_sample_with_wrong_bits_reaches_the_host(foot: Bench, errors: int) -> None:
    """P1: 1 byte in 1000 wrong took the walker 923 m away; each sample is read twice."""
    foot.fault(f"spi_errors={errors}")
    found = samples(run(foot, 10_000) + run(foot, 10_000))
    assert {x[2:] for x in found} == {tuple(STILL.ravel())}
    assert len(found) > 0.9 * 20 * RATE_HZ
    assert health(foot).errors > 100 * errors / 3
    assert [f for f in board_findings(foot.reports) if str(f).startswith("foot sensor (ICM-20649): sent wrong bits")]


def test_every_sample_comes_and_is_stamped_within_the_limit(foot: Bench) -> None:
    found = samples(run(foot, 10_000))
    assert len(found) == pytest.approx(10 * RATE_HZ, rel=0.012)  # its own clock is 1 % off
    assert {x[2:] for x in found} == {(10, -20, 30, 100, -200, 1_024)}
    assert set(np.diff([x.sample for x in found]) % 65_536) == {1}
    truth_us = np.array([t for t, text in foot.board.trace if text == "foot"]) * 1e-3
    stamps_us = np.array([x.ticks for x in found]) * 0.5
    after = np.clip(np.searchsorted(truth_us, stamps_us), 1, len(truth_us) - 1)
    begins_us = np.median(truth_us[after - 1] - stamps_us)
    errors_us = stamps_us + begins_us - truth_us[np.abs(truth_us[:, None] - begins_us - stamps_us).argmin(0)]
    assert np.abs(errors_us).max() <= STAMP_US
    assert foot.reader.counts.lost == 0


def test_samples_lie_between_the_rows_before_and_after_them(foot: Bench) -> None:
    """A rate that grows evenly is read without the rows' steps."""
    rows = foot_rows(1_000)
    rows["motion"]["rate"][:, 0, 0] = np.arange(1_000) * 30
    found = samples(foot.run(1_000, rows))
    slopes = np.diff([x.rate_x for x in found][5:]) / np.diff([x.ticks * 0.5e-3 for x in found][5:])
    assert np.abs(slopes - 30.0).max() < 0.5


def test_the_ranges_are_30_g_and_4000_degrees_a_second(foot: Bench) -> None:
    foot.fault("icm20649=saturated")
    assert samples(run(foot, 200))[-1][2:] == (32_767, 32_767, 32_767, 30_720, 30_720, 30_720)


def test_a_part_that_is_plugged_in_later_is_found(bench: Bench) -> None:
    bench.fault("kit=foot", "icm20649=absent")
    run(bench, 1_000)
    bench.ask(SUBSCRIBE)
    bench.fault("icm20649=ok")
    run(bench, 700)
    assert len(samples(run(bench, 1_000))) > 220
    assert next(x for x in reversed(bench.messages) if isinstance(x, m.Configuration)).sensors == 0


def test_a_reset_of_the_processor_costs_a_moment(foot: Bench) -> None:
    foot.fault("reset=watchdog")
    run(foot, 1_500)
    foot.ask(SUBSCRIBE)
    run(foot, 200)
    assert len(samples(run(foot, 1_000))) > 220
    assert not any(x.outcome == m.Outcome.ECHO for x in foot.messages if isinstance(x, m.Ping))


def test_a_host_that_asks_for_other_sensors_gets_none(foot: Bench) -> None:
    foot.ask(m.Configure(0xFF, m.Schedule.CONCURRENT, 200, 10, m.PressureMode.HIGH_SPEED))
    found = run(foot, 1_000)
    assert next(x for x in found if isinstance(x, m.Configuration)).sensors == 0
    assert not kinds(found)["Ping"] + kinds(found)["Gyros"]
