# SPDX-License-Identifier: MIT
"""Requests to an MT, as messages with their expected acknowledgements.

In: rates and modes. Out: `Request`s. Owns nothing; raises ValueError for settings that no MTx has.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

from echostep.xsens.mtdata import PROJECT, OutputFormat

CLOCK_HZ = 115_200  # unit of SetPeriod [CMT: period 1152 at 100 Hz]
SYNC_CLOCK_HZ = 29_491_200  # unit of SyncOut offsets and widths [CMT; LLCP, SetTransmitDelay: ticks of 1 / 29.4912 MHz]
SHORTEST_PERIOD, LONGEST_PERIOD = 225, 11_520  # ticks of CLOCK_HZ: 512 Hz, 10 Hz [CMT; LLCP, SetPeriod]
PULSE_S = 0.001  # width of a SyncOut pulse; by reason
BAUD = 115_200  # Bd of the MTx's port, and bits per second on its line
FRAME_OVERHEAD = 5  # bytes of a frame besides its payload [Manual 5.3.1]
BITS_PER_BYTE = 10  # on the line: start, 8 data, stop

WAKE_UP_ACK = 0x3F
_ERRORS = {  # [LLCP, Error]
    0x03: "invalid period",
    0x04: "invalid message",
    0x1E: "timer overflow",
    0x20: "invalid baud rate",
    0x21: "invalid parameter",
    0x28: "device error",
}


@dataclass(frozen=True, slots=True)
class Request:
    """A message to the MT, and the payload `answer` of its acknowledgement (None: any).

    `optional`: the setup goes on when it is refused. `legacy`: a device that refuses it is taken for a successor of the MTx.
    """

    name: str
    mid: int
    payload: bytes = b""
    answer: bytes | None = None
    optional: bool = False
    legacy: bool = False


GO_TO_CONFIG = Request("GoToConfig", 0x30)
GO_TO_MEASUREMENT = Request("GoToMeasurement", 0x10)
REQUEST_DEVICE_ID = Request("ReqDID", 0x00, optional=True)


def set_rate(rate_hz: float) -> tuple[Request, ...]:
    """SetPeriod and SetOutputSkipFactor for a rate [Manual 5.3.3; LLCP, SetPeriod]; raises ValueError for a rate that its clock cannot make."""
    for skip in range(10):
        period = CLOCK_HZ / (rate_hz * (skip + 1))
        if period.is_integer() and SHORTEST_PERIOD <= period <= LONGEST_PERIOD:
            return (
                Request("SetPeriod", 0x04, struct.pack(">H", int(period)), legacy=True),
                Request("SetOutputSkipFactor", 0xD4, struct.pack(">H", skip)),
            )
    raise ValueError(f"[mtx] rate_hz: an MTx cannot sample at {rate_hz:g} Hz; take 50, 60, 100, 120 or 128")


def set_output(output: OutputFormat) -> tuple[Request, ...]:
    """SetOutputMode and SetOutputSettings, each read back [Manual 5.3.3]."""
    mode, settings = struct.pack(">H", output.mode), struct.pack(">I", output.settings)
    return (
        Request("SetOutputMode", 0xD0, mode),
        Request("SetOutputSettings", 0xD2, settings),
        Request("ReqOutputMode", 0xD0, b"", mode),
        Request("ReqOutputSettings", 0xD2, b"", settings),
    )


def set_sync_out() -> tuple[Request, ...]:
    """SyncOut: a positive pulse of 1 ms at each sample, for the board's input capture [LLCP, SetSyncOutSettings; values: CMT]."""
    settings = (
        ("mode", struct.pack(">BH", 0, 0x0012)),  # pulse 2, positive 0x10
        ("skip factor", struct.pack(">BH", 1, 0)),
        ("offset", struct.pack(">BI", 2, 0)),
        ("pulse width", struct.pack(">BI", 3, round(PULSE_S * SYNC_CLOCK_HZ))),
    )
    return tuple(Request(f"SetSyncOutSettings {name}", 0xD8, payload, optional=True) for name, payload in settings)


def project_requests(rate_hz: float) -> tuple[Request, ...]:
    """All requests that set an MTx to `PROJECT` at this rate; raises ValueError for a rate beyond its clock or the baud rate."""
    frame_bits = BITS_PER_BYTE * (PROJECT.length + FRAME_OVERHEAD)
    if frame_bits * rate_hz > BAUD:
        raise ValueError(f"[mtx] rate_hz: {rate_hz:g} Hz do not fit {BAUD} Bd; at most {BAUD // frame_bits}")
    return (REQUEST_DEVICE_ID, *set_rate(rate_hz), *set_output(PROJECT), *set_sync_out())


def successor_requests(rate_hz: float) -> tuple[Request, ...]:
    """SetOutputConfiguration for the MTi 10, 100 and 1 series: counter, quaternion, accel, gyro, mag as floats [LLCP, SetOutputConfiguration]."""
    rate = round(rate_hz)
    outputs = [(0x1020, 0xFFFF), (0x2010, rate), (0x4020, rate), (0x8020, rate), (0xC020, rate)]
    payload = b"".join(struct.pack(">HH", *output) for output in outputs)
    return (Request("SetOutputConfiguration", 0xC0, payload, payload),)


def reset_heading() -> Request:
    """ResetOrientation, heading reset; accepted also while measuring [LLCP, ResetOrientation]."""
    return Request("ResetOrientation", 0xA4, b"\x00\x01")


def error_text(payload: bytes) -> str:
    """Text for the payload of an error message [LLCP, Error]."""
    code = payload[0] if payload else -1
    return f"error 0x{code:02X}, {_ERRORS.get(code, 'unknown')}" if payload else "an error without a code"
