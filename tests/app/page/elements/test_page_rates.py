# SPDX-License-Identifier: MIT
"""What the page says of a foot without samples: silent only when nothing comes, otherwise that what comes is of no use."""

from __future__ import annotations

import struct

from echostep.plan import NO_PLAN
from echostep.ports.chunks import MTX, Chunk, portion_of
from echostep.tracker import Tracker
from echostep.xsens import MTDATA2, encode_frame
from echostep_app.page.elements.stream_rates import StreamRateMeter

EULER = struct.pack(">HBH", 0x1020, 2, 1) + struct.pack(">HB3f", 0x2030, 12, 0.1, 0.2, 3.0)


def advice(received: bytes) -> str:
    """After four seconds in each of which these bytes come from the MTx."""
    tracker, meter = Tracker(NO_PLAN), StreamRateMeter()
    for k in range(1, 5):
        t_ns = k * 1_000_000_000
        tracker.take(portion_of([Chunk(MTX, t_ns, received)]))
        rates = meter.measure(tracker, t_ns, "")
    return rates.wrong


def test_silence_is_said_of_silence_alone() -> None:
    assert advice(b"") == "the MTx is silent: look at its plug and its power"
    no_use = "the MTx sends no usable samples"
    assert advice(encode_frame(MTDATA2, EULER)).startswith(
        f"{no_use} (without counter, acceleration or rate of turn): "
    )
    assert advice(b"\x55\x01\x80").startswith(f"{no_use}: ")


def test_what_is_wrong_with_the_reports_is_said_first() -> None:
    rates = StreamRateMeter().measure(Tracker(NO_PLAN), 0, "mqtt://broker: refused")
    assert rates.wrong == "mqtt://broker: refused"
