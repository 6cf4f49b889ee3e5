# SPDX-License-Identifier: MIT
"""What the terminal says of a beacon gateway."""

from __future__ import annotations

import pytest

from echostep.board.frames import encode
from echostep.board.gateway import Gateway
from echostep_app.output.terminal import gateway_words
from echostep_simulation.devices.beacon_gateway import message

GOOD = message(7, 3.25, 0.5, 10.0)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"range_mm": 65535}, "1 impossible ranges"),
        ({"bearing": 18_001}, "1 impossible bearings"),
        ({"age_ms": 5_000}, "1 late"),
    ],
)
def test_impossible_readings_are_named(wrong: dict[str, int], words: str) -> None:
    gateway = Gateway()
    gateway.read(encode(GOOD._replace(**wrong), 0), 10.0)
    assert words in gateway_words(gateway)
