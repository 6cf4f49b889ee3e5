# SPDX-License-Identifier: MIT
"""The MTx's successors: MTi of the 1 and 600 series are configured, their answers are checked, and their product code is named."""

from __future__ import annotations

import math
import re
import struct
from typing import NamedTuple

import pytest

from command_line import echostep
from echostep.xsens import MTDATA2, MtSample, MtxReader, encode_frame
from echostep_app.xsens.requests import successor_requests
from echostep_app.xsens.setup import State, force_range_g, product_text
from echostep_studies.simulation.devices.mtx_setup import DeviceState, MtxDevice
from players import python_board
from xsens.mt_lines import SAMPLE, Line, on_a_terminal

COUNTER, QUATERNION, ACCEL, GYRO, MAG, EULER = 0x1020, 0x2010, 0x4020, 0x8020, 0xC020, 0x2030
LEGACY = (0x04, 0xD0, 0xD2, 0xD4, 0xD8)  # requests of an MTx that it does not know
WITH_EACH = 0xFFFF


class Model(NamedTuple):
    """Product code, firmware, greatest rate of an orientation, and whether it computes one."""

    product: str
    firmware: tuple[int, int, int]
    rate_hz: int
    oriented: bool


MTI_1 = Model("MTi-1-0I-T-R", (1, 8, 2), 100, oriented=False)
MTI_3 = Model("MTi-3-8A7G6-DK", (1, 8, 2), 100, oriented=True)
MTI_630 = Model("MTi-630-8A1G6", (1, 9, 0), 400, oriented=True)


class MtiDevice(MtxDevice):
    """One MTi, as sold: Euler angles and a counter."""

    def __init__(self, model: Model = MTI_3) -> None:
        super().__init__()
        self.model = model
        self.outputs = {COUNTER: WITH_EACH, EULER if model.oriented else ACCEL: 100}

    @property
    def rate_hz(self) -> float:
        """How often it sends."""
        return float(max((hz for hz in self.outputs.values() if hz != WITH_EACH), default=100))

    @property
    def pulses(self) -> bool:
        """Never: SyncOut of an MTi is set in another way, or not there."""
        return False

    def _answer(self, mid: int, payload: bytes) -> bytes:
        if self.state is DeviceState.CONFIG and mid in LEGACY:
            return encode_frame(0x42, b"\x04")
        if self.state is not DeviceState.CONFIG or mid not in (0x12, 0x1C, 0xC0):
            return super()._answer(mid, payload)
        if mid == 0x12:
            return encode_frame(0x13, bytes(self.model.firmware) + bytes(8))
        if mid == 0x1C:
            return encode_frame(0x1D, self.model.product.encode().ljust(20))
        wanted = dict(struct.iter_unpack(">HH", payload))
        if not self.model.oriented and QUATERNION in wanted:
            return encode_frame(0x42, b"\x21")
        self.outputs = {i: hz if hz == WITH_EACH else min(hz, self.model.rate_hz) for i, hz in wanted.items()}
        return encode_frame(0xC1, b"".join(struct.pack(">HH", *output) for output in self.outputs.items()))

    def measure(self, sample: MtSample) -> bytes:
        """The frame of a measurement as it is set, or nothing while it does not measure."""
        if self.state is not DeviceState.MEASURING:
            return b""
        values = {
            QUATERNION: sample.quaternion,
            ACCEL: sample.accel,
            GYRO: sample.gyro,
            MAG: sample.mag,
            EULER: (0.0, 0.0, 0.0),
        }
        packets = b""
        for identifier in self.outputs:
            body = struct.pack(">H", sample.counter & 0xFFFF)
            if identifier != COUNTER:
                body = struct.pack(f">{len(values[identifier])}f", *values[identifier])
            packets += struct.pack(">HB", identifier, len(body)) + body
        return encode_frame(MTDATA2, packets)


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
