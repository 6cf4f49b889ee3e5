# SPDX-License-Identifier: MIT
"""Requests to an MT, as messages with their expected acknowledgements.

In: rates and modes. Out: `Request`s. Owns nothing; raises ValueError for settings that no MTx has.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, replace

from echostep.xsens.mtdata import PROJECT, OutputFormat

CLOCK_HZ = 115_200  # unit of SetPeriod [CMT: period 1152 at 100 Hz]
SYNC_CLOCK_HZ = 29_491_200  # unit of SyncOut offsets and widths [CMT; LLCP, SetTransmitDelay: ticks of 1 / 29.4912 MHz]
SHORTEST_PERIOD, LONGEST_PERIOD = 225, 11_520  # ticks of CLOCK_HZ: 512 Hz, 10 Hz [CMT; LLCP, SetPeriod]
PULSE_S = 0.001  # width of a SyncOut pulse; assumed
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

    `optional`: the setup goes on when it is refused. `instead`: when it is refused, these replace it and all that follow, and
    `remark` is printed. `rates`: the answer lists at least these outputs at these rates (Hz), by identifier.
    """

    name: str
    mid: int
    payload: bytes = b""
    answer: bytes | None = None
    optional: bool = False
    instead: tuple[Request, ...] = ()
    remark: str = ""
    rates: tuple[tuple[int, int], ...] = ()

    def fault(self, answer: bytes) -> str | None:
        """The fault of this answer, as text; "" when it is right, None when it answers another request of the same name."""
        if self.rates:
            return _rate_fault(dict(self.rates), answer)
        if self.answer is None or self.answer == answer:
            return ""
        return f"its answer is {answer.hex()}" if len(answer) == len(self.answer) else None


GO_TO_CONFIG = Request("GoToConfig", 0x30)
GO_TO_MEASUREMENT = Request("GoToMeasurement", 0x10)
REQUEST_DEVICE_ID = Request("ReqDID", 0x00, optional=True)
REQUEST_PRODUCT = Request("ReqProductCode", 0x1C, optional=True)
REQUEST_FIRMWARE = Request("ReqFWRev", 0x12, optional=True)
OUTPUTS = {
    0x1020: "sample counter",
    0x2010: "quaternion",
    0x4020: "acceleration",
    0x8020: "rate of turn",
    0xC020: "magnetic field",
}
COUNTER, NEEDED, WITH_ORIENTATION = 0x1020, (0x4020, 0x8020), (0x2010, 0x4020, 0x8020, 0xC020)
WITH_EACH = 0xFFFF  # instead of a rate: with every message [LLCP, SetOutputConfiguration]


def set_rate(rate_hz: float) -> tuple[Request, ...]:
    """SetPeriod and SetOutputSkipFactor for a rate [Manual 5.3.3; LLCP, SetPeriod]; raises ValueError for a rate that its clock cannot make."""
    for skip in range(10):
        period = CLOCK_HZ / (rate_hz * (skip + 1))
        if period.is_integer() and SHORTEST_PERIOD <= period <= LONGEST_PERIOD:
            by_period, instead = struct.pack(">H", int(period)), successor_requests(rate_hz)
            first = Request("SetPeriod", 0x04, by_period, instead=instead, remark="it sends MTData2")
            return first, Request("SetOutputSkipFactor", 0xD4, struct.pack(">H", skip))
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
    return (
        REQUEST_DEVICE_ID, REQUEST_PRODUCT, REQUEST_FIRMWARE, *set_rate(rate_hz), *set_output(PROJECT), *set_sync_out(),
    )  # fmt: skip


def successor_requests(rate_hz: float) -> tuple[Request, ...]:
    """SetOutputConfiguration for the MTi 1, 10, 100 and 600 series: counter, quaternion, accel, gyro, mag as floats [LLCP, SetOutputConfiguration].

    The answer lists the rates that the device really has. A device without orientation (MTi-1, MTi-610) may refuse it, and is asked for less.
    """
    least = _output_configuration(NEEDED, round(rate_hz))
    whole = _output_configuration(WITH_ORIENTATION, round(rate_hz))
    remark = "it sends neither orientation nor magnetic field"
    return (replace(whole, instead=(least,), remark=remark),)


def _output_configuration(outputs: tuple[int, ...], rate: int) -> Request:
    """Request for a counter with each message and these outputs at this rate."""
    wanted = [(COUNTER, WITH_EACH), *((identifier, rate) for identifier in outputs)]
    payload = b"".join(struct.pack(">HH", *output) for output in wanted)
    return Request(
        "SetOutputConfiguration", 0xC0, payload, rates=((COUNTER, rate), *((identifier, rate) for identifier in NEEDED))
    )


def _rate_fault(wanted: dict[int, int], answer: bytes) -> str:
    """Outputs that a SetOutputConfigurationAck lacks or has at another rate, as text. `WITH_EACH` is any rate."""
    rates = dict(struct.iter_unpack(">HH", answer[: len(answer) // 4 * 4]))
    faults = [
        f"{OUTPUTS[identifier]} at {rates[identifier]} Hz instead of {rate}"
        if identifier in rates
        else f"no {OUTPUTS[identifier]}"
        for identifier, rate in wanted.items()
        if rates.get(identifier) not in (rate, WITH_EACH)
    ]
    return f"it would send {', '.join(faults)}" if faults else ""


def error_text(payload: bytes) -> str:
    """Text for the payload of an error message [LLCP, Error]."""
    code = payload[0] if payload else -1
    return f"error 0x{code:02X}, {_ERRORS.get(code, 'unknown')}" if payload else "an error without a code"
