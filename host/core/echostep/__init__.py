# SPDX-License-Identifier: MIT
"""Indoor pedestrian tracking from a foot-mounted MTx, two ultrasonic rangers and the building's plan.

`replay(recording, plan)` tracks a recorded walk, `read_capture(path)` yields the messages of captured bytes, `Tracker` turns bytes into position
estimates; `plan`, `foot` and `xsens` are useful alone. These names are the public API. Each is loaded when first used, so that importing echostep
costs nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

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

__getattr__ = face(__name__)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
