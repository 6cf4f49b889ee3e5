"""What one can ask of an MT, as frames with their expected answers.

In: rates and modes. Out: `Request`s. Owns nothing; raises ValueError for what no MTx can do.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

from echostep.xsens.mtdata import PROJECT, OutputFormat

CLOCK_HZ = 115_200  # of sampling periods [CMT: period 1152 at 100 Hz]
SYNC_CLOCK_HZ = 29_491_200  # of SyncOut offsets and widths [CMT; LLCP, SetTransmitDelay: ticks of 1 / 29.4912 MHz]
SHORTEST_PERIOD, LONGEST_PERIOD = 225, 11_520  # 512 Hz, 10 Hz [CMT; LLCP, SetPeriod]
PULSE_S = 0.001
BAUD = 115_200

WAKE_UP_ACK = 0x3F
_ERRORS = {  # LLCP, Error
    0x03: "invalid period",
    0x04: "invalid message",
    0x1E: "timer overflow",
    0x20: "invalid baud rate",
    0x21: "invalid parameter",
    0x28: "device error",
}


@dataclass(frozen=True, slots=True)
class Request:
    """A message, and what its acknowledgement must hold (None: anything). `optional`: one can do without;
    `legacy`: who refuses it may be a successor of the MTx.
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
    """SyncOut: a positive pulse of 1 ms at each sample, as the board's input capture wants it [LLCP, SetSyncOutSettings; values: CMT]."""
    settings = (
        ("mode", struct.pack(">BH", 0, 0x0012)),  # pulse 2, positive 0x10
        ("skip factor", struct.pack(">BH", 1, 0)),
        ("offset", struct.pack(">BI", 2, 0)),
        ("pulse width", struct.pack(">BI", 3, round(PULSE_S * SYNC_CLOCK_HZ))),
    )
    return tuple(Request(f"SetSyncOutSettings {name}", 0xD8, payload, optional=True) for name, payload in settings)


def project_requests(rate_hz: float) -> tuple[Request, ...]:
    """Everything that brings an MTx to the project's mode; raises ValueError for a rate that the clock or the line cannot carry."""
    bits = 10 * (PROJECT.length + 5) * rate_hz
    if bits > BAUD:
        raise ValueError(
            f"[mtx] rate_hz: {rate_hz:g} Hz do not fit {BAUD} Bd; at most {BAUD // (10 * (PROJECT.length + 5))}"
        )
    return (REQUEST_DEVICE_ID, *set_rate(rate_hz), *set_output(PROJECT), *set_sync_out())


def successor_requests(rate_hz: float) -> tuple[Request, ...]:
    """SetOutputConfiguration for the MTi 10, 100 and 1 series: counter, quaternion, accel, gyro, mag as floats [LLCP, SetOutputConfiguration]."""
    rate = round(rate_hz)
    wanted = [(0x1020, 0xFFFF), (0x2010, rate), (0x4020, rate), (0x8020, rate), (0xC020, rate)]
    payload = b"".join(struct.pack(">HH", *pair) for pair in wanted)
    return (Request("SetOutputConfiguration", 0xC0, payload, payload),)


def reset_heading() -> Request:
    """ResetOrientation, heading reset; also while measuring [LLCP, ResetOrientation]."""
    return Request("ResetOrientation", 0xA4, b"\x00\x01")


def error_text(payload: bytes) -> str:
    """An error message in words [LLCP, Error]."""
    code = payload[0] if payload else -1
    return f"error 0x{code:02X}, {_ERRORS.get(code, 'unknown')}" if payload else "an error without a code"
