# SPDX-License-Identifier: MIT
"""MTData2: every number format and world; packets that do not add up."""

from __future__ import annotations

import math
import struct

import numpy as np
import pytest

from echostep.xsens import MTDATA2, MtxReader, axes, encode_frame


@pytest.mark.parametrize("form", range(4))
@pytest.mark.parametrize("world", [axes.ENU, axes.NED, axes.NWU])
def test_every_number_format_and_world(form: int, world: int) -> None:
    half = 2.0**-0.5
    sent = {
        0x2010: (half, 0.0, half, 0.0),
        0x4020: (0.5, -9.75, 2.25),
        0x8020: (-0.125, 1.5, 0.0),
        0xC020: (1.0, -0.5, 0.0),
    }
    payload = b"\x10\x20\x02\x12\x34"
    for identifier, values in sent.items():
        content = b"".join(NUMBERS[form](value) for value in values)
        payload += struct.pack(">HB", identifier | form | world, len(content)) + content
    batch = MtxReader().feed_batch(encode_frame(MTDATA2, payload))
    assert batch.counter.tolist() == [0x1234]
    assert (batch.accel[0].tolist(), batch.gyro[0].tolist()) == (list(sent[0x4020]), list(sent[0x8020]))
    assert batch.mag[0].tolist() == list(sent[0xC020])
    assert np.allclose(batch.quaternion, axes.to_mt_world(np.array([sent[0x2010]]), world), atol=1e-6)


NUMBERS = (
    lambda v: struct.pack(">f", v),
    lambda v: struct.pack(">i", round(v * 2**20)),
    lambda v: struct.pack(">Ih", round(v * 2**32) & 0xFFFFFFFF, math.floor(v)),
    lambda v: struct.pack(">d", v),
)


@pytest.mark.parametrize(
    "payload", ["10", "102002", "10200212", "1020031234 00", "40200400000000", "1020021234 4020ff", "402c0c" + 24 * "0"]
)
def test_packets_that_do_not_add_up_are_counted(payload: str) -> None:
    reader = MtxReader()
    assert reader.feed(encode_frame(MTDATA2, bytes.fromhex(payload.replace(" ", "")))) == []
    assert reader.counts.bad_length == 1
