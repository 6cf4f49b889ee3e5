# SPDX-License-Identifier: MIT
"""The MTx's successors: MTi of the 1 and 600 series are configured, their answers are checked, and their product code is named."""

from __future__ import annotations

import math
import re
import struct

import pytest

from command_line import echostep
from echostep.xsens import MtxReader
from echostep_app.xsens.requests import successor_requests
from echostep_app.xsens.setup import State, force_range_g, product_text
from players import python_board
from xsens.mt_lines import SAMPLE, Line, on_a_terminal
from xsens.simulated_mti import MTI_1, MTI_3, MTI_630, Model, MtiDevice


@pytest.mark.parametrize("model", [MTI_3, MTI_630, MTI_1])
def test_a_successor_is_configured_and_named(model: Model) -> None:
    line = Line(MtiDevice(model))
    setup = line.run(1.5)
    assert setup.state is State.CONFIGURED, setup.verdict
    firmware = ".".join(map(str, model.firmware))
    assert setup.verdict.startswith(f"MTx: configured: {model.product}, firmware {firmware}; it sends MTData2")
    assert ("neither orientation nor magnetic field" in setup.verdict) == (not model.oriented)
    last = MtxReader().feed(line.received)[-1]
    assert (last.accel, last.gyro) == (SAMPLE.accel, SAMPLE.gyro)
    assert math.isnan(last.quaternion[0]) == (not model.oriented)


def test_a_rate_that_it_cannot_have_is_said() -> None:
    setup = Line(MtiDevice(MTI_3), 120.0).run(2.5)
    assert setup.state is State.WRONG_MODE
    assert "it would send sample counter at 100 Hz" not in setup.verdict
    assert "acceleration at 100 Hz instead of 120, rate of turn at 100 Hz instead of 120" in setup.verdict
    assert Line(MtiDevice(MTI_630), 120.0).run(2.5).state is State.CONFIGURED


@pytest.mark.parametrize(
    ("answer", "fault"),
    [
        (((0x1020, 100), (0x4020, 100), (0x8020, 100)), ""),
        (((0x1020, 0xFFFF), (0x4020, 100)), "it would send no rate of turn"),
        ((), "it would send no sample counter, no acceleration, no rate of turn"),
    ],
)
def test_the_answer_is_compared_with_what_is_needed(answer: tuple[tuple[int, int], ...], fault: str) -> None:
    request = successor_requests(100.0)[0]
    assert request.payload.hex(" ", 4) == "1020ffff 20100064 40200064 80200064 c0200064"
    assert request.fault(b"".join(struct.pack(">HH", *output) for output in answer)) == fault
    assert request.fault(b"\xff" * 7)  # nonsense is a fault, not an exception


def test_product_codes() -> None:
    assert product_text(b"MTi-3-8A7G6-DK      ") == "MTi-3-8A7G6-DK"
    assert product_text(b"\x1b[2J") == ""
    assert [force_range_g(name) for name in ("MTi-3-8A7G6", "MTi-630-8A1G6", "MTi-30-2A5G4", "MTx-28A53G25")] == [
        16.0, 10.0, None, None
    ]  # fmt: skip


@pytest.mark.long
def test_the_doctor_configures_and_names_an_mti_on_a_port(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("echostep_app.xsens.setup.TIMEOUT_S", 10.0)  # the device shares this process
    device = MtiDevice(MTI_630)
    with on_a_terminal(device) as mtx, python_board() as board:
        done = echostep("doctor", "--board", board, "--mtx", mtx, "--seconds", 4)
    assert re.search(r"MTx +configured: MTi-630-8A1G6, firmware 1\.9\.0; it sends MTData2", done.stdout), done.stdout
    assert re.search(r"MTx +\d+\.\d samples/s", done.stdout), done.stdout  # as many as the machine gets round to
    assert "MTi-630-8A1G6 measures up to 10 g" in done.stdout
    assert set(device.outputs) == {0x1020, 0x2010, 0x4020, 0x8020, 0xC020}
