"""The text fields that a recording holds beside the bytes: what a replay needs, and what its reader may want to know.

In: plan, start, seed, settings; a recording's fields. Out: fields by name; start and seed read from them. Owns nothing. The names of the fields
are part of the file format.
"""

from __future__ import annotations

import importlib.metadata
import math
import platform
import time
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path

from echostep.board.messages import SCHEMA_HASH
from echostep.errors import EchostepError
from echostep.localization.particles import ANY_LEVEL
from echostep.plan.model import Plan, Pose

CHECK_IN_START = "tapped"  # value of the field `start`: the walk begins at a check-in
START_LIMIT_M = 1e6  # of a start's x and y; by reason: no plan is larger


def run_metadata(plan: Plan, start: Pose | None, seed: int, note: str, settings_toml: str = "") -> dict[str, str]:
    """Fields of a tracked run; a start of None is a check-in."""
    begin = {"start": CHECK_IN_START}
    if start is not None:
        begin = {"start_x_y_rad": f"{start.x_m!r},{start.y_m!r},{start.heading_rad!r},{start.level}"}
    return {
        **version_metadata(),
        "plan_name": plan.name,
        "plan_sha256": plan.digest,
        **begin,
        "seed": str(seed),
        "settings_toml": settings_toml,
        "note": note,
    }


def version_metadata() -> dict[str, str]:
    """Versions of everything that an estimate depends on."""
    versions = {"python": platform.python_version()}
    versions |= {name: importlib.metadata.version(name) for name in ("numpy", "numba")}
    return {
        "version": importlib.metadata.version("echostep"),
        "versions": ", ".join(f"{name} {version}" for name, version in versions.items()),
        "protocol": f"0x{SCHEMA_HASH:08X}",
    }


def clock_metadata() -> dict[str, str]:
    """The time of day (UTC) and the monotonic clock of the arrival times, read together."""
    return {"started_utc": datetime.now(UTC).isoformat(timespec="milliseconds"), "started_ns": str(time.monotonic_ns())}


def recorded_start(metadata: Mapping[str, str], path: Path) -> Pose | None:
    """The start of a recorded run, None when there is none; raises EchostepError when it is damaged."""
    text = metadata.get("start_x_y_rad")
    if text is None:
        return None
    try:
        x, y, heading, *level = (float(part) for part in text.split(","))
        return Pose(x, y, heading, int(level[0]) if level else 0)
    except (ValueError, TypeError, OverflowError) as error:
        raise EchostepError(f"{path}: its recorded start is damaged: give one with --start X,Y,DEG") from error


def recorded_seed(metadata: Mapping[str, str], path: Path) -> int:
    """The seed of a recorded run, 0 when there is none; raises EchostepError when it is damaged."""
    try:
        return int(metadata.get("seed", "0"))
    except ValueError as error:
        raise EchostepError(f"{path}: its recorded seed is damaged: give one with --seed N") from error


def parse_pose(text: str) -> Pose:
    """X,Y,DEG[,LEVEL] as a pose; LEVEL is the level's index from 0, or `?` for any. Raises EchostepError."""
    example = "expected X,Y,DEG[,LEVEL], for instance 1.5,2,90 or 1.5,2,90,3"
    parts = text.split(",")
    try:
        x, y, degrees = (float(part) for part in parts[:3])
        level = 0 if len(parts) < 4 else ANY_LEVEL if parts[3] == "?" else int(parts[3])
    except ValueError as error:
        raise EchostepError(f"--start {text}: {example}") from error
    within = all(math.isfinite(value) and abs(value) < START_LIMIT_M for value in (x, y, degrees))
    if not within or len(parts) > 4 or level < ANY_LEVEL:
        raise EchostepError(f"--start {text}: a number is out of range, or there are too many: {example}")
    return Pose(x, y, math.radians(degrees), level)
