# SPDX-License-Identifier: MIT
"""A simulated MTx that answers: its states, its settings, and its measurements in whatever output format it is set to.

In: bytes from the host, and samples. Out: bytes to the host. Owns the settings, as the device's memory does.
After power-on it sends WakeUp and measures with what it was set to unless the host answers [Xsens MT0101P, WakeUp].
"""

from __future__ import annotations

import struct
from enum import Enum

from echostep.xsens import MTDATA, FrameReader, MtSample, OutputFormat, encode_frame
from echostep.xsens.mtdata import ORIENTATION, QUATERNION, SAMPLE_COUNTER
from echostep_simulation.devices.mtx_formats import pack

FACTORY = OutputFormat(ORIENTATION, SAMPLE_COUNTER | QUATERNION)  # what an MTx is sold with [Xsens MT0100P, 5.2]
WAKE_UP_S = 0.5
DEVICE_ID = bytes.fromhex("00312345")
PRODUCT, FIRMWARE = b"MTx-28A53G25".ljust(20), bytes((2, 8, 1))
ACCEPTED = {
    0x00: (0,),
    0x04: (0, 2),
    0x12: (0,),
    0x1C: (0,),
    0xA4: (2,),
    0xD0: (0, 2),
    0xD2: (0, 4),
    0xD4: (0, 2),
    0xD8: (1, 3, 5),
}


class DeviceState(Enum):
    """State of the simulated device."""

    WAKING = "waking"
    CONFIG = "config"
    MEASURING = "measuring"


class MtxDevice:
    """One MTx; a `deaf` one measures but receives nothing, as with a broken line to its input."""

    def __init__(self, output: OutputFormat = FACTORY, *, deaf: bool = False) -> None:
        self.output = output
        self.deaf = deaf
        self.state = DeviceState.MEASURING
        self.period, self.skip = 1152, 0
        self.sync_out = {0: 0, 1: 0, 2: 0, 3: 29_491}  # parameter -> value
        self._woken_s = 0.0
        self._frames = FrameReader()

    @property
    def rate_hz(self) -> float:
        """How often it sends."""
        return 115_200 / self.period / (self.skip + 1)

    @property
    def pulses(self) -> bool:
        """Whether SyncOut gives a pulse at each sample."""
        return self.state is DeviceState.MEASURING and self.sync_out[0] & 0x0F == 2

    def power_on(self, now_s: float) -> bytes:
        """Restart the device, which sends a WakeUp."""
        self.state, self._woken_s = DeviceState.WAKING, now_s
        return encode_frame(0x3E)

    def feed(self, received: bytes, now_s: float) -> bytes:
        """Answer of the device to these bytes; b"" only advances its time."""
        if self.state is DeviceState.WAKING and now_s - self._woken_s >= WAKE_UP_S:
            self.state = DeviceState.MEASURING
        if self.deaf:
            return b""
        return b"".join(self._answer(frame.mid, frame.payload) for frame in self._frames.feed(received))

    def _answer(self, mid: int, payload: bytes) -> bytes:
        if self.state is DeviceState.WAKING:
            self.state = DeviceState.CONFIG if mid == 0x3F else DeviceState.WAKING
            return b""
        if mid == 0x30 or (mid == 0x10 and self.state is DeviceState.CONFIG):
            self.state = DeviceState.CONFIG if mid == 0x30 else DeviceState.MEASURING
            return encode_frame(mid + 1)
        if self.state is DeviceState.MEASURING and mid != 0xA4:
            return b""  # nothing else is valid while it measures
        if mid not in ACCEPTED or len(payload) not in ACCEPTED[mid]:
            return encode_frame(0x42, b"\x04")
        try:
            return encode_frame(mid + 1, self._set_or_tell(mid, payload))
        except (ValueError, KeyError):
            return encode_frame(0x42, b"\x21")

    def _set_or_tell(self, mid: int, payload: bytes) -> bytes:
        """Take a setting, or return it when the request has no value; raises ValueError or KeyError for a value that it does not take."""
        value = int.from_bytes(payload, "big")
        if mid == 0x00:
            return DEVICE_ID
        if mid in (0x12, 0x1C):
            return FIRMWARE if mid == 0x12 else PRODUCT
        if mid == 0xA4:
            return b""
        if mid == 0xD8:
            return self._sync(payload)
        if not payload:
            now = {
                0x04: struct.pack(">H", self.period),
                0xD0: struct.pack(">H", self.output.mode),
                0xD2: struct.pack(">I", self.output.settings),
                0xD4: struct.pack(">H", self.skip),
            }
            return now[mid]
        if mid == 0x04:
            if not 225 <= value <= 11_520:
                raise ValueError("period")
            self.period = value
        elif mid == 0xD4:
            self.skip = value
        elif mid == 0xD0:
            self.output = OutputFormat(value, self.output.settings)
        else:
            self.output = OutputFormat(self.output.mode, value)
        return b""

    def _sync(self, payload: bytes) -> bytes:
        parameter, value = payload[0], payload[1:]
        width = {0: 2, 1: 2, 2: 4, 3: 4}[parameter]
        if not value:
            return payload + self.sync_out[parameter].to_bytes(width, "big")
        if len(value) != width:
            raise ValueError("SyncOut")
        self.sync_out[parameter] = int.from_bytes(value, "big")
        return b""

    def measure(self, sample: MtSample) -> bytes:
        """The frame of a measurement as it is set, or nothing while it does not measure."""
        if self.state is not DeviceState.MEASURING:
            return b""
        return encode_frame(MTDATA, pack(sample, self.output))
