# SPDX-License-Identifier: MIT
"""Indoor pedestrian tracking from a foot-mounted MTx, two ultrasonic rangers and the building's plan.

`replay(recording, plan)` tracks a recorded walk, `read_capture(path)` yields the messages of captured bytes, `Tracker` turns bytes into position
estimates; `plan`, `foot` and `xsens` are useful alone. These names are the public API. Each is loaded when first used, so that importing echostep
costs nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from echostep import foot, plan, xsens
    from echostep.board import messages
    from echostep.localization.estimate import Estimate
    from echostep.localization.particles.start import Start
    from echostep.ports.chunks import Chunk
    from echostep.recording.capture import read_capture
    from echostep.settings import Settings
    from echostep.tracker import Tracker
    from echostep.walk.walk import Walk, replay

__all__ = [
    "Chunk",
    "Estimate",
    "Settings",
    "Start",
    "Tracker",
    "Walk",
    "foot",
    "messages",
    "plan",
    "read_capture",
    "replay",
    "xsens",
]

_MODULES = {name: f"echostep.{name}" for name in ("foot", "plan", "xsens")} | {"messages": "echostep.board.messages"}
_HOMES = {
    "Chunk": "echostep.ports.chunks",
    "Estimate": "echostep.localization.estimate",
    "Settings": "echostep.settings",
    "Start": "echostep.localization.particles.start",
    "Tracker": "echostep.tracker",
    "Walk": "echostep.walk.walk",
    "read_capture": "echostep.recording.capture",
    "replay": "echostep.walk.walk",
}


def __getattr__(name: str) -> Any:
    if name in _MODULES:
        return importlib.import_module(_MODULES[name])
    if name in _HOMES:
        return getattr(importlib.import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'echostep' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
