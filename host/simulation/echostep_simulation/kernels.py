# SPDX-License-Identifier: MIT
"""The kernels of a simulated walk, called once.

In: nothing. Out: kernels in the cache. Owns nothing.
"""

from __future__ import annotations

from importlib.resources import as_file, files
from itertools import islice

from echostep.plan import load_plan
from echostep_simulation.devices.board import PythonBoard
from echostep_simulation.scenario import demo_scenario

CHUNKS = 300  # of the demo: about a second


def simulation() -> None:
    """The first second of the demo's walk."""
    with as_file(files("echostep") / "plans/demo.json") as path:
        for _ in islice(demo_scenario(load_plan(path), 0, PythonBoard(0)).chunks(), CHUNKS):
            pass
