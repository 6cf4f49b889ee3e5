"""Check-in: the wearer's position, entered by hand.

In: what was tapped on the page. Out: the bytes of a chunk of the port `PERSON`, and `CheckIn`s from such bytes. Owns nothing. The bytes are recorded
like those of any port, so that a replay has the same check-ins in the same order; like those of any port they may be damaged or hostile.
"""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass
from typing import Any

from echostep.plan.json_fields import LIMIT_M
from echostep.plan.model import Pose

PERSON = "person"
# All by reason.
MOST_BYTES = 512  # of one check-in
MOST_LEVELS = 1000
LEAST_SD_M, MOST_SD_M = 0.05, 100.0
HEADING_SD_RAD = math.radians(15.0)  # of a heading that was entered


@dataclass(frozen=True, slots=True)
class CheckIn:
    """A position (x_m, y_m) on a level, with standard deviation `sd_m` per axis; `heading_rad` is None when it was not entered."""

    x_m: float
    y_m: float
    heading_rad: float | None
    sd_m: float
    level: int = 0

    @property
    def pose(self) -> Pose:
        """Position and heading; east when none was entered."""
        return Pose(self.x_m, self.y_m, self.heading_rad or 0.0, self.level)

    def encode(self) -> bytes:
        """Bytes of a chunk."""
        return json.dumps(asdict(self)).encode()


def parse_check_in(payload: bytes) -> CheckIn | None:
    """The check-in of a chunk; None for bytes that are not one."""
    if len(payload) > MOST_BYTES:
        return None
    try:
        return check_in_of(json.loads(payload))
    except (ValueError, RecursionError):
        return None


def check_in_of(tree: Any) -> CheckIn | None:
    """The check-in in a JSON object; None when a field is missing or out of range. Other fields are ignored."""
    if not isinstance(tree, dict):
        return None
    x, y, sd, heading = (_number(tree.get(name)) for name in ("x_m", "y_m", "sd_m", "heading_rad"))
    level = tree.get("level", 0)
    if x is None or y is None or sd is None or (heading is None and tree.get("heading_rad") is not None):
        return None
    if isinstance(level, bool) or not isinstance(level, int) or not 0 <= level < MOST_LEVELS:
        return None
    wrapped = None if heading is None else math.remainder(heading, 2.0 * math.pi)
    return CheckIn(x, y, wrapped, min(max(sd, LEAST_SD_M), MOST_SD_M), level)


def _number(value: Any) -> float | None:
    """A finite number within the limits of a plan's coordinates; None for anything else."""
    fits = isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= LIMIT_M
    return float(value) if fits else None
