# SPDX-License-Identifier: MIT
"""A new recording, and its text fields: the inputs of a replay, and notes for its reader.

In: plan, start, seed, settings; command line arguments. Out: fields by name; a start, or EchostepError for one that cannot be. Owns nothing.
`walk.recorded` reads the fields.
"""

from __future__ import annotations

import importlib.metadata
import json
import math
import platform
from collections.abc import Mapping
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from echostep.board.messages import SCHEMA_HASH
from echostep.errors import EchostepError
from echostep.localization import Start
from echostep.plan import ANY_LEVEL, NO_PLAN, Plan, Pose
from echostep.ports.people.check_in import MOST_SD_M
from echostep.walk.recorded import ANYWHERE, CHECK_IN_START, START_LIMIT_M
from echostep_app.plan.importers.limited import open_limited
from echostep_app.plan.places.standing import refuse_impossible
from echostep_app.ports.arrival_clock import now_ns
from echostep_app.printing.console import console
from echostep_app.recording.names import link_newest, remove_older
from echostep_app.recording.recorder import Recorder
from echostep_app.recording.splitting import SplitLimit, numbered_recorder
from echostep_app.session.options import TrackingOptions

ROOM_M = 2.0  # standard deviation of a start in a room without an outline: half a large room
LAST = "last"  # value of `--start`: where the last live run ended


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


def check_start(plan: Plan, start: Pose | Start | None, *, given: bool, recorded: bool = False) -> None:
    """Refuse an impossible start. `given`: on the command line; else it is the recording's if `recorded`, and only noted, or the plan's."""
    start = start.pose if isinstance(start, Start) else start
    if start is None or start.level < 0 or not plan.is_drawn:
        return  # a check-in, a room, anywhere, on any level; no plan that could object
    shown = f"{start.x_m:g},{start.y_m:g},{math.degrees(start.heading_rad):.0f}"
    if recorded and not given:
        try:
            refuse_impossible(plan, start, f"Note: the recorded start {shown}")
        except EchostepError as error:
            console.print(str(error), markup=False)
        return
    refuse_impossible(plan, start, f"--start {shown}" if given else f"the plan's start {shown}")


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
    """Anywhere in the room of this name, or the only one that begins so: in its outline, or within ROOM_M of its label; None for none."""
    rooms = [(k, room) for k, level in enumerate(plan.levels) for room in level.rooms]
    same = [each for each in rooms if each[1].name.casefold() == name.casefold()]
    begin = [each for each in rooms if each[1].name.casefold().startswith(name.casefold())]
    if not same and len(begin) != 1:
        return None
    k, room = (same or begin)[0]
    if room.outline_m is not None and len(room.outline_m):
        return Start(room_m=np.asarray(room.outline_m, np.float64), level=k)
    return Start(Pose(*room.at_m, 0.0, k), ROOM_M, math.pi)


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


def start_recording(
    wanted: Path, metadata: Mapping[str, str], keep: int | None = None, split: SplitLimit | None = None
) -> Recorder:
    """A recorder on a new file named after `wanted`; raises EchostepError. `keep`: remove the oldest until so many are left. `split`: in parts."""
    recorder = numbered_recorder(wanted, metadata, split)
    if link_newest(recorder.path, wanted):
        console.print(f"Recording: {recorder.path}, also named {wanted.name}", highlight=False)
    else:
        other = f"; {wanted.name} is another file and stays as it is" if wanted.exists() else ""
        console.print(f"Recording: {recorder.path}{other}", highlight=False)
    for path in remove_older(wanted, keep) if keep else ():
        console.print(f"Removed: {path} (--keep {keep})", highlight=False)
    return recorder
