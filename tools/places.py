# SPDX-License-Identifier: MIT
"""Where things are in a checkout, for all tools.

In: nothing. Out: paths; the command that starts the twin. Owns nothing. Every tool is started in the root of the checkout, with
`PYTHONPATH=tools:tests:tests/app .venv/bin/python -m FOLDER.TOOL`.
"""

from __future__ import annotations

from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
OUT = ROOT / "out"
PLAN = ROOT / "host/core/echostep/plans/demo.json"
TWIN = [str(ROOT / "tools/twin/build/echostep-twin"), "--elf", str(ROOT / "firmware/build/echostep.elf")]
