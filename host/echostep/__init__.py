# SPDX-License-Identifier: MIT
"""Indoor pedestrian tracking from a foot-mounted MTx, two ultrasonic rangers and the building's plan.

`read_capture(path)` yields the messages of captured bytes, `Tracker` turns bytes into position estimates, `plan`, `foot` and `xsens` are useful
alone. These names are the public API. Each is loaded when first used, so that importing echostep costs nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from echostep import foot, plan, xsens
    from echostep.board import messages
    from echostep.recording.capture import read_capture
    from echostep.tracker import Tracker

__all__ = ["Tracker", "foot", "messages", "plan", "read_capture", "xsens"]

_MODULES = {name: f"echostep.{name}" for name in ("foot", "plan", "xsens")} | {"messages": "echostep.board.messages"}
_HOMES = {"Tracker": "echostep.tracker", "read_capture": "echostep.recording.capture"}


def __getattr__(name: str) -> Any:
    if name in _MODULES:
        return importlib.import_module(_MODULES[name])
    if name in _HOMES:
        return getattr(importlib.import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'echostep' has no attribute {name!r}")
