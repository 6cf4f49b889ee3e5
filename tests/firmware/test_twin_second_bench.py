# SPDX-License-Identifier: MIT
"""What is likely to go wrong with the first boards, provoked in the twin: each has its words, which stand in firmware/README.md."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from board_runs import ROOT, Bench, needs_twin, pings
from echostep.board import messages as m
from echostep.board.reports import BoardReports
from echostep_app.board.faults.electrical import electrical_findings, level_line
from echostep_app.board.faults.health import Finding, board_findings
from echostep_app.board.subscription import SUBSCRIBE_ELECTRICAL
from echostep_app.commissioning.diagnosis import _echo_findings
from echostep_app.commissioning.probe import ProbeResult
from echostep_simulation.stimulus import EXTENDED_ROW, NO_SYNC
from firmware.findings import findings_of

pytestmark = needs_twin
README = ROOT / "firmware/README.md"

# What is done to the board; what `echostep doctor --electrical` says; whether the README's table names it.
DAY_ONE = [
    (("kit=2026", "pulse_left=stuck_low"), "D4: is driven low and never rises"),
    (("kit=2026", "pulse_right=stuck_low"), "D13: reads zero"),
    (("kit=foot", "icm20649=zeros"), "SPI bus: no part answers on SPI, and MISO is low"),
    (("kit=2026", "imu_thigh=absent"), "thigh gyro: does not answer"),
    (("kit=2026", "imu_calf=no_self_test"), "calf gyro (LSM6DSO): failed its self-test"),
    (("kit=2026", "spi_errors=100"), "belt gyro (LSM6DSO): sent wrong bits"),
    (("kit=2026", "pulse_left=absent", "hum=50"), "D4: is open"),
    (("kit=2026", "pulse_left=held"), "left ranger: receives no echo"),
    (("kit=2026", "sda=stuck_forever"), "SDA: is held low (D2)"),
    (("kit=foot", "icm20649=never_ready"), "foot sensor (ICM-20649): answers, but its data-ready line does not pulse"),
    (("kit=2026", "bmp390=wrong_identity"), "barometer: holds a part that the firmware does not know"),
    (("kit=2026", "miso_undefined=noise"), "MISO: rests between the processor's thresholds"),
]


def findings(bench: Bench) -> list[Finding]:
    """All findings on all reports, as `echostep doctor --electrical` makes them."""
    reports, found = BoardReports(), []
    for message in bench.messages:
        reports.add(message)
        if isinstance(message, m.Status):
            found += board_findings(reports) + electrical_findings(reports)
    pings = [x for x in bench.messages if isinstance(x, m.Ping)]
    return found + _echo_findings(ProbeResult(reports=reports, pings=pings))


def run_with(bench: Bench, *faults: str) -> list[str]:
    begin(bench, *faults)
    bench.run(6_000, rows(6_000))
    return [str(finding) for finding in findings(bench)]


@pytest.mark.parametrize(("faults", "words"), DAY_ONE)
def test_each_failure_of_the_first_day_has_its_words(bench: Bench, faults: tuple[str, ...], words: str) -> None:
    assert [text for text in run_with(bench, *faults) if text.startswith(words)]
    assert words in README.read_text()


@pytest.mark.parametrize(("kit", "level"), [("2026", "MISO low"), ("papers", "MISO high"), ("foot", "MISO low")])
def test_a_board_that_is_well_has_no_electrical_finding(bench: Bench, kit: str, level: str) -> None:
    run_with(bench, f"kit={kit}")
    assert electrical_findings(bench.reports) == []
    assert level in level_line(bench.reports)


def test_a_resistor_makes_the_idle_line_a_one(bench: Bench) -> None:
    run_with(bench, "kit=2026", "miso_resistor=2200", "miso_undefined=noise")
    reports = next(x for x in reversed(bench.messages) if isinstance(x, m.Electrical))
    assert reports.miso_ones == reports.readings


def test_a_bare_processor_board_is_normal(bench: Bench) -> None:
    """As flashed in step 2, with mains hum on its open inputs."""
    said = run_with(bench, "kit=2026", "hum=50", *(f"{name}=absent" for name in BARE))
    assert [text for text in said if text.startswith("SPI bus: no part answers on SPI, and nothing pulls MISO down")]
    assert [text for text in said if text.startswith("D13: is open")]
    assert not any(isinstance(x, m.Ping) and x.outcome == m.Outcome.ECHO for x in bench.messages)


BARE = ("bmp390", "imu_thigh", "imu_calf", "imu_belt", "pulse_left", "pulse_right", "lis3mdl")
ECHO_US = 5831
LEAST_OPEN = 0.5


def rows(milliseconds: int, echo_us: int = 0) -> np.ndarray[tuple[int], np.dtype[np.void]]:
    """Rows of somebody who stands: walls on both sides with this echo, or in the open."""
    table = np.zeros(milliseconds, EXTENDED_ROW)
    table["row"]["sync_us"], table["row"]["pressure"], table["row"]["own_us"] = NO_SYNC, 405_296, echo_us
    table["motion"]["force"][:, :, 2] = 4_098
    return table


def begin(bench: Bench, *faults: str) -> None:
    """A board with these faults, asked for all reports."""
    bench.fault(*faults)
    bench.run(300, rows(300))
    bench.ask(SUBSCRIBE_ELECTRICAL)


@pytest.mark.parametrize("reads", ["ones", "zeros", "noise"])
def test_a_led_on_d13_is_no_ranger(bench: Bench, reads: str) -> None:
    """N1: a Micro's LED holds the bare pin between the thresholds; nothing is wrong with it."""
    begin(bench, "kit=2026", f"d13_led={reads}", *(f"{name}=absent" for name in BARE))
    bench.run(4_000, rows(4_000))
    assert not [f for f in electrical_findings(bench.reports) if f.subject == "D13" and "driven low" in str(f)]


def test_a_module_without_a_timeout_hears_the_wall_again(bench: Bench) -> None:
    """N2: such a module holds its line until an echo comes, which none does: its side was dead from the first open door on."""
    begin(bench, "kit=2026", "pulse_left=no_timeout")
    bench.run(2_000, rows(2_000, ECHO_US))
    open_side = pings(bench.run(3_000, rows(3_000)), m.Ranger.LEFT)
    back = pings(bench.run(3_000, rows(3_000, ECHO_US)), m.Ranger.LEFT)
    assert Counter(p.outcome for p in open_side)[m.Outcome.NO_ECHO] >= 6
    assert [p.outcome for p in back[2:]].count(m.Outcome.ECHO) == len(back) - 2 > 30


@pytest.mark.parametrize(
    ("module", "words"), [("no_timeout", "holds its Echo line high"), ("endless", "its echo line stays high")]
)
def test_a_module_that_holds_its_line_is_named(bench: Bench, module: str, words: str) -> None:
    begin(bench, "kit=2026", f"pulse_left={module}")
    bench.run(2_000, rows(2_000, ECHO_US))
    bench.run(4_000, rows(4_000))
    assert [
        x for x in findings_of(bench) if x.startswith(f"left ranger (pulse ranger): {words}") and "does not fit" in x
    ]


@pytest.mark.parametrize(("cycle_us", "least_hz"), [(61_000, 30.0), (66_000, 28.0), (70_000, 26.5), (75_000, 25.0)])
def test_the_schedule_follows_the_measured_cycle(bench: Bench, cycle_us: int, least_hz: float) -> None:
    """N4: above 66 ms the sides lost their half period, and from 73 ms on every ping failed."""
    begin(bench, "kit=papers", f"srf_cycle={cycle_us}")
    bench.run(2_000)
    found = [x for x in bench.run(20_000) if isinstance(x, m.Ping)]
    assert {p.outcome for p in found} == {m.Outcome.ECHO}
    assert len(found) >= 20 * least_hz
    left, right = (np.array([p.ticks for p in found if p.ranger == side]) * 5e-4 for side in m.Ranger)
    after_ms = right - left[np.searchsorted(left, right) - 1]
    period_ms = float(np.median(np.diff(left)))
    assert np.abs(after_ms[1:-1] - period_ms / 2).max() < 9.0  # twice the jitter


@pytest.mark.parametrize("cycle_us", [61_000, 66_000, 70_000])
def test_echoes_beyond_the_range_say_open(bench: Bench, cycle_us: int) -> None:
    """A ranger that listens for 60 ms hears the other one's burst and the hall's reverberation as walls at 6.7 to 11 m."""
    begin(bench, "kit=papers", f"srf_cycle={cycle_us}", "srf_window=60000", "fading=50")
    table = rows(10_000)["row"].copy()
    table["cross_us"][:, 0] = 9_000
    bench.run(500, table[:500])
    left = pings(bench.run(10_000, table), m.Ranger.LEFT)
    assert np.mean([p.outcome == m.Outcome.NO_ECHO for p in left]) > LEAST_OPEN


@pytest.mark.parametrize(
    ("schedule", "crosses", "least_open"),
    [
        (m.Schedule.CONCURRENT, False, 0.5),
        (m.Schedule.SEQUENTIAL, True, 1.0),
        (m.Schedule.SIMULTANEOUS, False, 1.0),
        (m.Schedule.SIMULTANEOUS, True, 0.0),
    ],
)
def test_ghosts_of_the_schedules(bench: Bench, schedule: m.Schedule, crosses: bool, least_open: float) -> None:
    """At an open door, in a hall that fades as the maker says: at once, no burst fades into the next one, but a cross echo is one at each ping."""
    begin(bench, "kit=papers", "srf_window=60000", "fading=50")
    bench.ask(m.Configure(0xFF, schedule, 200, 10, m.PressureMode.HIGH_SPEED))
    table = rows(10_000)["row"].copy()
    table["own_us"][:, 1], table["cross_us"][:, 0] = ECHO_US, 9_000 if crosses else 0
    bench.run(1_000, table[:1_000])
    found = [x for x in bench.run(10_000, table) if isinstance(x, m.Ping)]
    left = [p.outcome == m.Outcome.NO_ECHO for p in found if p.ranger == m.Ranger.LEFT]
    assert least_open - 0.06 <= np.mean(left) <= least_open + 0.06
    assert len(found) > (130 if schedule == m.Schedule.SEQUENTIAL else 300)
    if schedule == m.Schedule.SIMULTANEOUS:
        fired = [np.array([p.ticks for p in found if p.ranger == side]) for side in m.Ranger]
        # 1.5 ms: one transfer on the bus after the other
        assert np.abs(np.subtract.outer(*fired)).min(axis=0).max() < 3_000


def test_a_ghost_after_a_silence_is_a_silence(bench: Bench) -> None:
    """N6: the ping after one without an echo reads 8 cm; half of the pings that say "open" were lost to it."""
    begin(bench, "kit=2026", "pulse_left=ghost")
    found = pings(bench.run(4_000, rows(4_000)), m.Ranger.LEFT)
    assert Counter(p.outcome for p in found[2:]) == {m.Outcome.NO_ECHO: len(found) - 2}


def test_an_idle_bus_does_not_stop_the_board(bench: Bench) -> None:
    """N8: where the flag of a suspended bus comes back at once, the board still pings."""
    begin(bench, "kit=2026", "suspend_repeats=on")
    bench.run(1_000, rows(1_000, ECHO_US))
    before = len(bench.board.trace)
    bench.fault("usb=suspend")
    bench.run(5_000, rows(5_000, ECHO_US))
    triggers = [text for _, text in bench.board.trace[before:] if text.startswith("trigger")]
    bench.fault("usb=resume")
    bench.fault("suspend_repeats=off")
    assert len(triggers) > 145
    assert len(pings(bench.run(2_000, rows(2_000, ECHO_US)), m.Ranger.LEFT)) > 25
    bench.fault("usb=suspend")
    bench.run(1_000, rows(1_000))
    bench.fault("usb=resume")
    bench.ask(SUBSCRIBE_ELECTRICAL)
    bench.run(2_500, rows(2_500))
    assert next(x for x in reversed(bench.messages) if isinstance(x, m.BoardHealth)).suspends == 2


@pytest.mark.parametrize(("kit", "name"), [("2026", "belt"), ("foot", "foot")])
def test_two_boards_of_a_kit_have_two_names(bench: Bench, kit: str, name: str) -> None:
    """N10: both claimed /dev/echostep; udev knows them by the interface's string, which the host reads last."""
    begin(bench, f"kit={kit}", "host_hub=on")  # which debounces the port for 100 ms, as hosts do [USB 2.0, 7.1.7.3]
    bench.run(1_000, rows(1_000))
    assert [text for _, text in bench.board.trace if text.startswith("usb interface")] == [f"usb interface {name}"]


@pytest.mark.parametrize(("kit", "part"), [("2026", "imu_calf"), ("foot", "icm20649")])
def test_the_lamp_beats_slowly_on_a_board_that_is_well(bench: Bench, kit: str, part: str) -> None:
    """N9: a beat says that it lives; a fast one, that a part is missing."""
    begin(bench, f"kit={kit}")
    for way, least, most in (("ok", 9, 10), ("absent", 70, 80)):
        bench.fault(f"{part}={way}")
        bench.run(2_000, rows(2_000, ECHO_US))
        before = len(bench.board.trace)
        bench.run(5_000, rows(5_000, ECHO_US))
        assert least <= sum(text.startswith("lamp") for _, text in bench.board.trace[before:]) <= most
