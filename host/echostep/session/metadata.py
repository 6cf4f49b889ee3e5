# SPDX-License-Identifier: MIT
"""The text fields that a recording holds beside the bytes: what a replay needs, and what its reader may want to know.

In: plan, start, seed, settings; a recording's fields. Out: fields by name; start and seed read from them. Owns nothing. The names of the fields
are part of the file format.
"""

from __future__ import annotations

import importlib.metadata
import json
import math
import platform
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np
from msgspec import Meta

from echostep.board.messages import SCHEMA_HASH
from echostep.errors import EchostepError
from echostep.localization.particles.start import ANY_LEVEL, Air, Start
from echostep.plan.importers.limited import open_limited
from echostep.plan.model import NO_PLAN, Plan, Pose
from echostep.ports.arrival_clock import now_ns
from echostep.ports.people.check_in import MOST_SD_M
from echostep.session.options import TrackingOptions

ANYWHERE = "anywhere"  # value of the field `start`: the walk begins anywhere in the building, or in a room
ROOM_M = 2.0  # standard deviation of a start in a room without an outline: half a large room
CHECK_IN_START = "tapped"  # value of the field `start`: the walk begins at a check-in
LAST = "last"  # value of `--start`: where the last live run ended
SIMULATED = "simulated"  # value of the field `source`
START_LIMIT_M = 1e6  # of a start's x and y: no plan is larger
Coordinate = Annotated[float, Meta(ge=-START_LIMIT_M, lt=START_LIMIT_M)]


class RecordedRoom(msgspec.Struct):
    """The field `start_room`: the walk begins in this outline, None: anywhere, on this level."""

    outline_m: list[tuple[Coordinate, Coordinate]] | None = None
    level: int = ANY_LEVEL


class RecordedPause(msgspec.Struct):
    """The field `start_after_pause`: the heights by the barometer of the run before, None where there are none."""

    air: Air | None


def run_metadata(
    plan: Plan, start: Pose | Start | None, seed: int, note: str, settings_toml: str = "", source: str = "live"
) -> dict[str, str]:
    """Fields of a tracked run; a start of None is a check-in. `source`: `live`, or `SIMULATED`."""
    begin = {"start": CHECK_IN_START} if start is None else _start_fields(start)
    return {
        **version_metadata(),
        "plan_name": plan.name,
        "plan_sha256": plan.digest,
        **begin,
        "seed": str(seed),
        "settings_toml": settings_toml,
        "note": note,
        "source": source,
    }


def is_simulated(metadata: Mapping[str, str]) -> bool:
    """Whether a recording is of a simulation."""
    return metadata.get("source") == SIMULATED


def shown_name(path: Path, metadata: Mapping[str, str]) -> str:
    """The name of a recording, which says so where it is simulated."""
    return f"{path.name}{' (simulated)' if is_simulated(metadata) else ''}"


def _start_fields(start: Pose | Start) -> dict[str, str]:
    """Fields of a start: its mean pose, its standard deviations, or the outline of the room; neither: anywhere."""
    if isinstance(start, Pose):
        return {"start_x_y_rad": _pose_text(start)}
    fields = {"start_sd_m_rad": f"{start.sd_m!r},{start.heading_sd_rad!r}"}
    if start.after_pause:
        fields["start_after_pause"] = json.dumps({"air": start.air and asdict(start.air)})
    if start.pose is not None:
        return fields | {"start_x_y_rad": _pose_text(start.pose)}
    room = None if start.room_m is None else start.room_m.tolist()
    return fields | {"start": ANYWHERE, "start_room": json.dumps({"outline_m": room, "level": start.level})}


def _pose_text(pose: Pose) -> str:
    return f"{pose.x_m!r},{pose.y_m!r},{pose.heading_rad!r},{pose.level}"


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
    """The time of day (UTC) and the clock of the arrival times, read together."""
    return {"started_utc": datetime.now(UTC).isoformat(timespec="milliseconds"), "started_ns": str(now_ns())}


def recorded_start(metadata: Mapping[str, str], path: Path) -> Pose | Start | None:
    """The start of a recorded run, None when there is none; raises EchostepError when it is damaged."""
    try:
        if metadata.get("start") == ANYWHERE:
            room = msgspec.json.decode(metadata.get("start_room", "{}"), type=RecordedRoom)
            outline = None if room.outline_m is None else np.array(room.outline_m).reshape(-1, 2)
            return Start(room_m=outline, level=room.level)
        text = metadata.get("start_x_y_rad")
        if text is None:
            return None
        x, y, heading, *level = bounded(float(part) for part in text.split(","))
        pose = Pose(x, y, heading, int(level[0]) if level else 0)
        if "start_sd_m_rad" not in metadata:
            return pose
        sd_m, sd_rad = bounded((float(part) for part in metadata["start_sd_m_rad"].split(",")), least=0.0)
        if "start_after_pause" not in metadata:
            return Start(pose, sd_m, sd_rad)
        pause = msgspec.json.decode(metadata["start_after_pause"], type=RecordedPause)
        return Start(pose, sd_m, sd_rad, air=possible(pause.air), after_pause=True)
    except (ValueError, OverflowError, RecursionError, msgspec.MsgspecError) as error:
        raise EchostepError(f"{path}: its recorded start is damaged: give one with --start X,Y,DEG") from error


def recorded_seed(metadata: Mapping[str, str], path: Path) -> int:
    """The seed of a recorded run, 0 when there is none; raises EchostepError when it is damaged."""
    try:
        return int(metadata.get("seed", "0"))
    except ValueError as error:
        raise EchostepError(f"{path}: its recorded seed is damaged: give one with --seed N") from error


def plan_of(tracking: TrackingOptions) -> Plan:
    """The plan of the command's options; NO_PLAN where none was given."""
    return NO_PLAN if tracking.plan_path is None else open_limited(tracking.plan_path)


def start_given(tracking: TrackingOptions, plan: Plan) -> Pose | Start | None:
    """The start of the command's options; None where none was given. Raises EchostepError."""
    if tracking.start is not None:
        return parse_start(tracking.start, tracking.start_sd, plan)
    if tracking.start_sd is None:
        return None
    if plan.start is None:
        raise EchostepError("--start-sd: the plan has no start: give one with --start X,Y,DEG")
    sd_m, sd_deg = _parse_spread(tracking.start_sd)
    return Start(plan.start, sd_m, math.radians(sd_deg))


def possible(air: Air | None) -> Air | None:
    """The heights by pressure; raises ValueError where they are out of bounds."""
    if air is not None:
        bounded([air.zero_m])
        bounded([air.sd_m], least=0.0)
    return air


def bounded(values: Iterable[float], least: float = -START_LIMIT_M) -> list[float]:
    """The values (m or rad); raises ValueError for one that is not finite, or out of bounds."""
    numbers = list(values)
    if not all(least <= value < START_LIMIT_M for value in numbers):
        raise ValueError
    return numbers


def parse_start(text: str, spread: str | None, plan: Plan) -> Pose | Start:
    """The start of `--start` and `--start-sd`: X,Y,DEG[,LEVEL], the name of a room, or `?` for anywhere. Raises EchostepError."""
    sd = None if spread is None else _parse_spread(spread)
    if text == "?":
        return Start()
    if (room := _room(text, plan)) is not None:
        return room
    if text == LAST:
        raise EchostepError("--start last: only of a live run; a replay begins where the recorded run did")
    pose = _parse_pose(text, plan)
    return pose if sd is None else Start(pose, sd[0], math.radians(sd[1]))


def _room(name: str, plan: Plan) -> Start | None:
    """Anywhere in the room of this name: in its outline, or within ROOM_M of its label; None for no such room."""
    for k, level in enumerate(plan.levels):
        for room in level.rooms:
            if room.name.casefold() == name.casefold():
                if room.outline_m is not None and len(room.outline_m):
                    return Start(room_m=np.asarray(room.outline_m, np.float64), level=k)
                return Start(Pose(*room.at_m, 0.0, k), ROOM_M, math.pi)
    return None


def _parse_spread(text: str) -> tuple[float, float]:
    """M,DEG: standard deviations of a start's place and heading."""
    try:
        sd_m, sd_deg = (float(part) for part in text.split(","))
    except ValueError as error:
        raise EchostepError(f"--start-sd {text}: expected M,DEG, for instance 1,20") from error
    if not (0.0 < sd_m <= MOST_SD_M and 0.0 < sd_deg <= 360.0):
        raise EchostepError(
            f"--start-sd {text}: M must be above 0 and at most {MOST_SD_M:g}, DEG above 0 and at most 360"
        )
    return sd_m, sd_deg


def _parse_pose(text: str, plan: Plan) -> Pose:
    """X,Y,DEG[,LEVEL] as a pose; LEVEL is the level's index from 0, or `?` for any. Raises EchostepError."""
    example = "expected X,Y,DEG[,LEVEL], for instance 1.5,2,90 or 1.5,2,90,3, the name of a room, or ? for anywhere"
    parts = text.split(",")
    try:
        x, y, degrees = (float(part) for part in parts[:3])
        level = 0 if len(parts) < 4 else ANY_LEVEL if parts[3] == "?" else int(parts[3])
    except ValueError as error:
        names = sorted({room.name for each in plan.levels for room in each.rooms})
        known = f"; the rooms are: {', '.join(names)}" if names else "; this plan names no rooms"
        raise EchostepError(f"--start {text}: {example}{known}") from error
    within = all(math.isfinite(value) and abs(value) < START_LIMIT_M for value in (x, y, degrees))
    if not within or len(parts) > 4 or level < ANY_LEVEL:
        raise EchostepError(f"--start {text}: a number is out of range, or there are too many: {example}")
    return Pose(x, y, math.radians(degrees), level)
