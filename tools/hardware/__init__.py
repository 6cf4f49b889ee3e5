# SPDX-License-Identifier: MIT
"""Documents for building the boards, made from two tables: parts.toml and wiring.toml in firmware/hardware.

In: these tables. Out: nets that are checked, wiring drawings, KiCad schematics, tables for the README; boxes checked and drawn. Owns nothing.
"""

from places import ROOT

HARDWARE = ROOT / "firmware" / "hardware"
