# SPDX-License-Identifier: MIT
"""Airtime of LoRa packets, and how often each of several wearers may send.

In: a modem preset of a Meshtastic node, the length of a payload, the number of wearers. Out: seconds. Owns the presets
[Meshtastic, radio settings: modem presets].
"""

from __future__ import annotations

import math
from typing import NamedTuple

INTERVAL_S = 10.0  # between two positions of a wearer where the airtime allows it
MOST_USED = 0.25  # share of the channel's time that all wearers together take [Meshtastic, polite channel utilization]
PREAMBLE = 16 + 4.25  # symbols of Meshtastic's preamble and of the synchronisation [AN1200.13]
OVERHEAD = 16 + 8  # bytes beside the payload: Meshtastic's packet header, and the fields of its Data message
SLOW_SYMBOL_S = 0.016  # longer symbols are sent with the low data rate optimisation [AN1200.13]


class Modem(NamedTuple):
    """Spreading factor, bandwidth in Hz, and the denominator of the coding rate 4/5 to 4/8."""

    spreading: int
    bandwidth_hz: float
    coding: int


PRESETS = {
    "SHORT_TURBO": Modem(7, 500e3, 5), "SHORT_FAST": Modem(7, 250e3, 5), "SHORT_SLOW": Modem(8, 250e3, 5),
    "MEDIUM_FAST": Modem(9, 250e3, 5), "MEDIUM_SLOW": Modem(10, 250e3, 5), "LONG_TURBO": Modem(11, 500e3, 8),
    "LONG_FAST": Modem(11, 250e3, 5), "LONG_MODERATE": Modem(11, 125e3, 8), "LONG_SLOW": Modem(12, 125e3, 8),
    "VERY_LONG_SLOW": Modem(12, 62.5e3, 8),
}  # fmt: skip

SLOWEST = PRESETS["LONG_SLOW"]  # of those in use: assumed for a preset that is not known


def airtime_s(modem: Modem, payload: int) -> float:
    """Seconds on air of a packet with `payload` bytes of payload, explicit header and checksum [Semtech, AN1200.13, 4]."""
    symbol_s = 2**modem.spreading / modem.bandwidth_hz
    slow = 2 if symbol_s > SLOW_SYMBOL_S else 0
    bits = 8 * (payload + OVERHEAD) - 4 * modem.spreading + 28 + 16
    blocks = max(math.ceil(bits / (4 * (modem.spreading - slow))), 0)
    return (PREAMBLE + 8 + blocks * modem.coding) * symbol_s


def interval_s(modem: Modem, payload: int, wearers: int) -> float:
    """Time between two positions of each wearer, so that all of them take at most MOST_USED of the channel."""
    return max(INTERVAL_S, wearers * airtime_s(modem, payload) / MOST_USED)
