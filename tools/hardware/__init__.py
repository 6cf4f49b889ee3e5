# SPDX-License-Identifier: MIT
"""Checks of the documents for building the boards in firmware/hardware.

In: parts.toml, wiring.toml, schematics, boxes. Out: problems in words. Owns nothing.
"""

from places import ROOT

HARDWARE = ROOT / "firmware" / "hardware"
