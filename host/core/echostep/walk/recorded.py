# SPDX-License-Identifier: MIT
"""Data of the run in a recording besides the bytes: start, seed, settings; and the tracker of a replay.

In: a recording's text fields. Out: start, seed, `Tracker`. Owns nothing. The names of the fields are part of the file format.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np
from msgspec import Meta

from echostep.errors import EchostepError
from echostep.height.levels import Air
from echostep.localization import Start
from echostep.plan import ANY_LEVEL, Plan, Pose
from echostep.recording import Recording
from echostep.settings import Settings, parse_settings, read_settings
from echostep.tracker import Tracker

ANYWHERE = "anywhere"  # value of the field `start`: the walk begins anywhere in the building, or in a room
CHECK_IN_START = "tapped"  # value of the field `start`: the walk begins at a check-in
SIMULATED = "simulated"  # value of the field `source`
START_LIMIT_M = 1e6  # of a start's x and y: no plan is larger
Coordinate = Annotated[float, Meta(ge=-START_LIMIT_M, lt=START_LIMIT_M)]


class RecordedRoom(msgspec.Struct):
    """The field `start_room`: the walk begins in this outline, or anywhere if None, on this level."""

    outline_m: list[tuple[Coordinate, Coordinate]] | None = None
    level: int = ANY_LEVEL


class RecordedPause(msgspec.Struct):
    """The field `start_after_pause`: the heights by the barometer of the run before, or None."""

    air: Air | None


def is_simulated(metadata: Mapping[str, str]) -> bool:
    """Whether a recording is of a simulation."""
    return metadata.get("source") == SIMULATED


def shown_name(path: Path, metadata: Mapping[str, str]) -> str:
    """The name of a recording, marked if it is simulated."""
    return f"{path.name}{' (simulated)' if is_simulated(metadata) else ''}"


def tracker_of(
    recording: Recording,
    plan: Plan,
    start: Pose | Start | None = None,
    settings: Settings | Path | str | None = None,
    seed: int | None = None,
) -> Tracker:
    """A tracker with the recorded start, settings and seed unless they are given; settings also as a TOML file.

    Raises EchostepError when one of them is missing or damaged.
    """
    metadata, path = recording.metadata, recording.path
    if not isinstance(settings, Settings):
        text = metadata.get("settings_toml", "") if settings is None else read_settings(settings)
        settings = parse_settings(text, str(path if settings is None else settings), recorded=settings is None)
    start = start or recorded_start(metadata, path)
    try:
        seed = int(metadata.get("seed", "0")) if seed is None else seed
    except ValueError as error:
        raise EchostepError(f"{path}: its recorded seed is damaged: give one with --seed N") from error
    return Tracker(plan, start, settings, seed, waits=metadata.get("start") == CHECK_IN_START)


def recorded_start(metadata: Mapping[str, str], path: Path) -> Pose | Start | None:
    """The start of a recorded run, None if missing; raises EchostepError when it is damaged."""
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


def possible(air: Air | None) -> Air | None:
    """The heights by pressure; raises ValueError if they are out of bounds."""
    if air is not None:
        bounded([air.zero_m])
        bounded([air.sd_m], least=0.0)
    return air


def bounded(values: Iterable[float], least: float = -START_LIMIT_M) -> list[float]:
    """The values (m or rad); raises ValueError if one is not finite, or out of bounds."""
    numbers = list(values)
    if not all(least <= value < START_LIMIT_M for value in numbers):
        raise ValueError
    return numbers
