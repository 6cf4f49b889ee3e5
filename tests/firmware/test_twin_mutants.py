# SPDX-License-Identifier: MIT
"""Mutated data-sheet constants of the drivers: the twin must notice each, by a message, a value or a finding.

A mutant is the firmware with one constant changed, compiled and run for 4.5 s: at rest, then evenly turned, pushed and lifted. What it sends is
compared with what the unchanged firmware sends.
"""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from board_runs import ELF, ROOT, TWIN, Bench, kinds, needs_twin
from echostep.board import messages as m
from echostep.board.reports import SUBSCRIBE
from echostep_simulation.devices.board import BoardProcess
from echostep_simulation.stimulus import EXTENDED_ROW, NO_SYNC
from firmware.findings import findings_of

pytestmark = needs_twin
FIRMWARE = ROOT / "firmware"
REST_MS, MOVING_MS = 2_500, 2_000
LAST_S = 0.5  # of rest and of motion: what is compared
SHARE, COUNTS = 0.003, 3.0  # a value that differs by less is no other; of its size, and in counts
LEAST_MESSAGES = 0.1  # a stream that differs by a smaller share is no other
VALUES = (m.Gyros, m.Motion, m.Magnetic, m.Pressure, m.Foot, m.GyroHealth, m.Ping, m.Compass)

KIT_2026 = ("kit=2026",)
VIBRATING = ("kit=2026", "imu_calf=vibrating")
FOOT, PAPERS = ("kit=foot",), ("kit=papers",)


class Mutant(NamedTuple):
    """The constant `name` of `file`, changed from `right` to `wrong`, on a board with these `faults`; what this `means`."""

    means: str
    file: str
    name: str
    right: str
    wrong: str
    faults: tuple[str, ...] = KIT_2026


MUTANTS = [
    Mutant("gyros 500 deg/s", "lsm6dso.c", "CTRL2_G_1667_HZ_1000_DPS", "0x88u", "0x84u"),
    Mutant("foot's gyros through 12 Hz", "icm20649.c", "GYRO_120_HZ_4000_DPS", "0x17u", "0x2Fu", FOOT),
    Mutant("pressure through a filter of 127", "bmp390.c", "IIR_3", "0x04u", "0x0Eu"),
    Mutant("compass 16 gauss", "lis3mdl.c", "CTRL_REG2_4_GAUSS", "0x00u", "0x60u"),
    Mutant("forces 4 g", "lsm6dso.c", "CTRL1_XL_1667_HZ_8_G", "0x8Eu", "0x8Au"),
    Mutant("forces 16 g", "lsm6dso.c", "CTRL1_XL_1667_HZ_8_G", "0x8Eu", "0x86u"),
    Mutant("forces at 12.5 Hz", "lsm6dso.c", "CTRL1_XL_1667_HZ_8_G", "0x8Eu", "0x1Eu"),
    Mutant("gyros asleep", "lsm6dso.c", "CTRL4_C_SPI_ONLY_FILTER", "0x06u", "0x46u"),
    Mutant("addresses do not count up", "lsm6dso.c", "CTRL3_C_WHOLE_SAMPLES", "0x44u", "0x40u"),
    Mutant("three wires", "lsm6dso.c", "CTRL3_C_WHOLE_SAMPLES", "0x44u", "0x4Cu"),
    Mutant("gyros through 274 Hz", "lsm6dso.c", "CTRL6_C_50_HZ", "0x05u", "0x00u", VIBRATING),
    Mutant("foot's forces through 6 Hz", "icm20649.c", "ACCEL_111_HZ_30_G", "0x17u", "0x37u", FOOT),
    Mutant("foot's clock stopped", "icm20649.c", "BEST_CLOCK", "0x01u", "0x07u", FOOT),
    Mutant("conversion longer than its period", "bmp390.c", "ODR_FAST", "0x04u", "0x02u"),
    Mutant("compass at 0.6 Hz", "lis3mdl.c", "CTRL_REG1_FINEST_80_HZ", "0x7Cu", "0x60u"),
    Mutant("compass, bytes exchanged", "lis3mdl.c", "CTRL_REG4_FINEST_Z", "0x0Cu", "0x0Eu"),
    Mutant("ADIS16100's coding", "adis16100.c", "COMMAND_RATE", "0x8300u", "0x8310u", PAPERS),
    Mutant("gyros at 26 Hz", "lsm6dso.c", "CTRL2_G_1667_HZ_1000_DPS", "0x88u", "0x28u"),
    Mutant("forces without LPF2", "lsm6dso.c", "CTRL1_XL_1667_HZ_8_G", "0x8Eu", "0x8Cu", VIBRATING),
    Mutant("gyros without LPF1", "lsm6dso.c", "CTRL4_C_SPI_ONLY_FILTER", "0x06u", "0x04u", VIBRATING),
    Mutant("I3C on", "lsm6dso.c", "CTRL9_XL_I3C_OFF", "0xE2u", "0xE0u"),
    Mutant("self-test of one sign", "lsm6dso.c", "CTRL5_C_NEGATIVE", "0x0Cu", "0x04u"),
    Mutant("foot's gyros 2000 deg/s", "icm20649.c", "GYRO_120_HZ_4000_DPS", "0x17u", "0x15u", FOOT),
    Mutant("foot's forces 8 g", "icm20649.c", "ACCEL_111_HZ_30_G", "0x17u", "0x13u", FOOT),
    Mutant("foot at 112 Hz", "icm20649.c", "DIVIDER", "4u", "9u", FOOT),
    Mutant("foot without data-ready", "icm20649.c", "RAW_DATA_READY", "0x01u", "0x00u", FOOT),
    Mutant("barometer without temperature", "bmp390.c", "PRESSURE_AND_TEMPERATURE_NORMAL", "0x33u", "0x31u"),
    Mutant("barometer, three wires", "bmp390.c", "FOUR_WIRES", "0x00u", "0x01u"),
    Mutant("another checksum", "bmp390.c", "CRC_POLYNOMIAL", "0x1Du", "0x07u"),
    Mutant("compass measures once", "lis3mdl.c", "CTRL_REG3_CONTINUOUS", "0x00u", "0x01u"),
    Mutant("trigger of 12 us", "avr/capture.c", "TRIGGER_US", "60", "12"),
    Mutant("SRF02 in cm", "srf02.c", "COMMAND_RANGE_US", "0x52u", "0x51u", PAPERS),
    Mutant("SCP1000 at 1.8 Hz", "scp1000.c", "OPERATION_HIGH_SPEED", "0x09u", "0x0Au", PAPERS),
]  # fmt: skip
ORDINARY = 4


def rows() -> NDArray[Any]:
    """Rest between two walls, then all quantities grow evenly."""
    table = np.zeros(REST_MS + MOVING_MS, EXTENDED_ROW)
    grown = np.maximum(np.arange(len(table)) - REST_MS, 0)
    plain, motion = table["row"], table["motion"]
    plain["sync_us"], plain["own_us"], plain["temperature"], plain["bearing"] = NO_SYNC, 5_831, 480, 900
    plain["pressure"] = 405_296 - 2 * grown
    for k, name in enumerate(("thigh", "calf", "belt")):
        plain[name] = 41 + (10 + k) * grown // 100
    motion["rate"], motion["force"] = (30, -40, 20), (100, -200, 4_098)
    motion["rate"] += (np.arange(9).reshape(3, 3) - 4) * grown[:, None, None] // 4
    motion["force"] += (4 - np.arange(9).reshape(3, 3)) * grown[:, None, None] // 3
    table["field"] = (1_000, -2_000, 3_000) + np.array([1, 2, -1]) * grown[:, None]
    return table


class Sent(NamedTuple):
    """What a board has sent: number of messages by kind, (median, spread) of each value at rest and in motion, findings."""

    counts: dict[str, int]
    values: dict[str, NDArray[Any]]
    findings: set[str]


def _values(found: list[m.Message], when: str) -> Iterator[tuple[str, NDArray[Any]]]:
    """Median and spread about the mean motion of each field."""
    for kind in VALUES:
        sent = [x for x in found if isinstance(x, kind)]
        for k, field in enumerate(kind._fields[1:], 1):
            y = np.array([x[k] for x in sent], float)
            t = np.array([x.ticks for x in sent], float) * 5e-7
            if len(y) > 4:
                level = np.median(y)
                rest = y - np.polyval(np.polyfit(t - t[0], y, 1), t - t[0])
                yield f"{kind.__name__}.{field} {when}", np.array([level, np.ptp(rest)])


def run(elf: Path, faults: tuple[str, ...]) -> Sent:
    """Run a firmware for 4.5 s."""
    bench = Bench(BoardProcess([str(TWIN), "--elf", str(elf)]))
    table, values, last = rows(), dict[str, NDArray[Any]](), int(1_000 * LAST_S)
    bench.fault(*faults)
    bench.run(300, table[:300])
    bench.ask(SUBSCRIBE)
    for when, begin, end in (("at rest", 300, REST_MS), ("in motion", REST_MS, len(table))):
        bench.run(end - last - begin, table[begin : end - last])
        values.update(_values(bench.run(last, table[end - last : end]), when))
    bench.board.close()
    traces = {text for _, text in bench.board.trace if "too short" in text}
    return Sent(dict(kinds(bench.messages)), values, {text.split(";")[0] for text in findings_of(bench)} | traces)


def killed_by(right: Sent, mutant: Sent) -> str:
    """The first difference; empty: none."""
    for text in sorted(mutant.findings - right.findings):
        return f"finding: {text}"
    for kind in sorted(right.counts.keys() | mutant.counts.keys()):
        was, now = right.counts.get(kind, 0), mutant.counts.get(kind, 0)
        if abs(now - was) > LEAST_MESSAGES * was:
            return f"message: {now} {kind}, should be {was}"
    for name, pair in right.values.items():
        for what, good, bad in zip(("median", "spread"), pair, mutant.values.get(name, pair), strict=True):
            if abs(bad - good) > COUNTS + SHARE * np.abs(pair).max():
                return f"{what}: {name} {bad:.0f}, should be {good:.0f}"
    return ""


def compiled(mutant: Mutant, folder: Path) -> Path:
    """The ELF of a mutant."""
    shutil.copytree(FIRMWARE, folder, ignore=shutil.ignore_patterns("hardware", "host"))
    source = folder / mutant.file
    before, after = (f"#define {mutant.name} {value}" for value in (mutant.right, mutant.wrong))
    text = source.read_text()
    assert text.count(before) == 1, before
    source.write_text(text.replace(before, after))
    subprocess.run(["make", "-C", folder, "build/echostep.elf"], check=True, capture_output=True)
    return folder / "build/echostep.elf"


@pytest.fixture(scope="module")
def rights() -> dict[tuple[str, ...], Sent]:
    """What the unchanged firmware sends, by the board's faults."""
    return {faults: run(ELF, faults) for faults in (KIT_2026, VIBRATING, FOOT, PAPERS)}


@pytest.mark.parametrize(
    "mutant",
    [pytest.param(x, id=x.means, marks=[pytest.mark.long] * (k >= ORDINARY)) for k, x in enumerate(MUTANTS)],
)
def test_a_mutated_constant_is_noticed(mutant: Mutant, rights: dict[tuple[str, ...], Sent], tmp_path: Path) -> None:
    reason = killed_by(rights[mutant.faults], run(compiled(mutant, tmp_path / "firmware"), mutant.faults))
    print(f"{mutant.means} | {reason}")
    assert reason


@pytest.mark.parametrize("faults", [pytest.param(KIT_2026, marks=pytest.mark.long), FOOT])
def test_a_change_without_effect_is_no_mutant(
    faults: tuple[str, ...], rights: dict[tuple[str, ...], Sent], tmp_path: Path
) -> None:
    """Else all would be killed by chance."""
    other = Mutant("wakes oftener", "main.c", "SLEEP_MAX_TICKS", "(5u * TICKS_PER_MS)", "(3u * TICKS_PER_MS)")
    assert killed_by(rights[faults], run(compiled(other, tmp_path / "firmware"), faults)) == ""
