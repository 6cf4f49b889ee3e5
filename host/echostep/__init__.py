"""echostep: where somebody is in a building, from a foot-mounted MTx, two ultrasonic rangers and the plan.

`read_capture(path)` gives the messages of captured bytes (`messages.Ping` and so on); `Tracker` tracks. All are loaded when first used.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from echostep.board import messages
    from echostep.recording.capture import read_capture
    from echostep.tracker import Tracker

__all__ = ["Tracker", "messages", "read_capture"]

_HOMES = {"Tracker": "echostep.tracker", "read_capture": "echostep.recording.capture"}


def __getattr__(name: str) -> Any:
    if name == "messages":
        return importlib.import_module("echostep.board.messages")
    if name in _HOMES:
        return getattr(importlib.import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'echostep' has no attribute {name!r}")
