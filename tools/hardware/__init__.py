# SPDX-License-Identifier: MIT
"""Materials for building the boards, made from two tables: parts.toml and wiring.toml in firmware/hardware.

In: these tables. Out: nets that are checked, wiring drawings, KiCad schematics, tables for the README; boxes checked and drawn. Owns nothing.
"""

from pathlib import Path

HARDWARE = Path(__file__).resolve().parents[2] / "firmware" / "hardware"
