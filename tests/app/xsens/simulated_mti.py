# SPDX-License-Identifier: MIT
"""A simulated MTi of the 1 or 600 series, a successor of the MTx: its settings, and MTData2 with the outputs that it is set to.

In: bytes from the host, and samples. Out: bytes to the host. Owns the list of outputs, as the device's memory does.
It knows SetOutputConfiguration in the place of an MTx's settings, and answers with the rates that it really has [Xsens MT0605P.E, 5.3.3].
"""

from __future__ import annotations

import struct
from typing import NamedTuple

from echostep.xsens import MTDATA2, MtSample, encode_frame
from echostep_studies.simulation.devices.mtx_setup import DeviceState, MtxDevice

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
