# SPDX-License-Identifier: MIT
"""Indoor pedestrian tracking from a foot-mounted MTx, two ultrasonic rangers and the building's plan.

`replay(recording, plan)` tracks a recorded walk, `read_capture(path)` yields the messages of captured bytes, `Tracker` turns bytes into position
estimates; `plan`, `foot` and `xsens` are useful alone. These names are the public API. Each is loaded when first used, so that importing echostep
costs nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from echostep.additions import face

if TYPE_CHECKING:
    from echostep import foot, plan, xsens
    from echostep.board import messages
    from echostep.localization import Estimate, Start
    from echostep.ports.chunks import Chunk
    from echostep.recording import read_capture
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
_load = face(
    __name__,
    {
        "localization": "Estimate Start",
        "ports.chunks": "Chunk",
        "recording": "read_capture",
        "settings": "Settings",
        "tracker": "Tracker",
        "walk.walk": "Walk replay",
    },
)


def __getattr__(name: str) -> Any:
    if name in _MODULES:
        return importlib.import_module(_MODULES[name])
    return _load(name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
