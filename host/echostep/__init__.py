"""echostep: where somebody is in a building, from a foot-mounted MTx, two ultrasonic rangers and the plan.

`read_capture(path)` gives the messages of captured bytes; `Tracker` tracks. Both are loaded when first used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from echostep.capture import read_capture
    from echostep.tracker import Tracker

__all__ = ["Tracker", "read_capture"]


def __getattr__(name: str) -> Any:
    if name == "read_capture":
        from echostep.capture import read_capture

        return read_capture
    if name == "Tracker":
        from echostep.tracker import Tracker

        return Tracker
    raise AttributeError(f"module 'echostep' has no attribute {name!r}")
