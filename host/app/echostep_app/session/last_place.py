# SPDX-License-Identifier: MIT
"""The last place of a live run, kept with its recording, and a run that begins there (`--start last`).

In: estimates of a run; the file of an earlier one, the plan, the board. Out: `last.json` in the output folder; a `Start`, with words about it. Owns
the file. A run that ends without notice, as with an empty battery, has kept the place of KEPT_S ago or less.
"""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime
from pathlib import Path

import msgspec

from echostep.errors import EchostepError
from echostep.file_mode import claim
from echostep.height.levels import ClimbSettings, drift_m
from echostep.localization import Estimate, Start, TrackStatus
from echostep.path import MeasuredSegment
from echostep.plan import Plan, Pose
from echostep.tracker import Tracker
from echostep.tracker.state import LastPlace
from echostep.walk.recorded import bounded, possible
from echostep_app.session.metadata import LAST

FILE = "last.json"
KEPT_S = 5.0  # between two writes: a few strides
MOST_BYTES = 4096  # of the file
GIVE = "give a start with --start X,Y,DEG, a room, or ?"


class DamagedPlaceError(EchostepError):
    """The file is there and holds no place."""


MOVED_M = 1.0  # standard deviation per axis of the way while a battery is changed on the spot: a stride


@dataclass(frozen=True, slots=True)
class Kept:
    """Contents of the file: the place, when (UTC), on which plan, with which board (its USB serial number; empty: it has none)."""

    place: LastPlace
    utc: datetime
    plan_sha256: str
    board: str


class PlaceKeeper:
    """Writes the place of a run every KEPT_S while the tracker is sure of it; a disk that refuses stops nothing."""

    def __init__(self, folder: Path, tracker: Tracker, board: str) -> None:
        """`board`: its number."""
        self._path, self._tracker, self._board = folder / FILE, tracker, board
        self._kept_s = -math.inf

    def note(self, _measured: MeasuredSegment | None, estimate: Estimate) -> None:
        """Look at a new estimate."""
        if estimate.status is not TrackStatus.TRACKING or estimate.t_s - self._kept_s < KEPT_S:
            return
        place = self._tracker.last_place()
        if place is None:
            return
        self._kept_s = estimate.t_s
        fields = {"utc": datetime.now(UTC).isoformat(), "plan_sha256": self._tracker.plan.digest, "board": self._board}
        written = self._path.with_suffix(".new")
        try:
            claim(written).write_text(json.dumps(fields | {"place": asdict(place)}), encoding="utf-8")
            written.replace(self._path)
        except OSError:
            return


def read_kept(folder: Path) -> Kept:
    """The last run's place in a folder; raises EchostepError where there is nothing, DamagedPlaceError where it is damaged."""
    path = folder / FILE
    try:
        with path.open("rb") as file:
            kept = msgspec.json.decode(file.read(MOST_BYTES), type=Kept)
        bounded([kept.place.x_m, kept.place.y_m])
        bounded([kept.place.sd_m, kept.place.level], least=0.0)
        possible(kept.place.air)
        return replace(kept, utc=kept.utc.astimezone(UTC))
    except FileNotFoundError as error:
        raise EchostepError(f"--start {LAST}: {path}: no run has kept a place there: {GIVE}") from error
    except (OSError, ValueError, OverflowError, RecursionError, msgspec.MsgspecError) as error:
        raise DamagedPlaceError(f"--start {LAST}: {path} cannot be used: {GIVE}") from error


def start_last(last: Kept, plan: Plan, board: str, climbing: ClimbSettings, now: datetime) -> tuple[Start, str]:
    """The start of a run where the last one ended, and words about it; raises EchostepError on another plan.

    The pressure is carried over only with the same board: another barometer may differ by storeys. It is not where the clock went back.
    """
    if last.plan_sha256 != plan.digest or last.place.level >= len(plan.levels):
        raise EchostepError(f"--start {LAST}: the last run was on another plan: {GIVE}")
    away_s, place = (now - last.utc).total_seconds(), last.place
    is_same = bool(board) and board == last.board and away_s >= 0.0
    start = start_after(
        place if is_same else LastPlace(place.x_m, place.y_m, place.sd_m, place.level), away_s, climbing
    )
    ago = (
        f"{away_s:.0f} s ago"
        if away_s >= 0.0
        else "the time since is not known, for this computer's clock was set back"
    )
    words = f"Start: where the last run ended, {ago}: {place.x_m:.1f}, {place.y_m:.1f}"
    if len(plan.levels) > 1:
        remark = (
            "the pressure tells the storey"
            if start.air
            else "the pressure does not tell the storey (not the same board)"
        )
        words += f" on {plan.levels[place.level].name}; {remark}"
    return start, f"{words}. The building is searched too: after a walk meanwhile the echoes find the place."


def start_after(place: LastPlace, away_s: float, climbing: ClimbSettings) -> Start:
    """The start of a run that begins `away_s` after another one ended at a place: the battery was changed, or the program started again.

    As after a pause (`gaps`): the cloud lies about the last place, with any heading, as the walk frame is new; the whole building is searched too,
    for the wearer may have moved on. Pressure gives the level at once if the barometer is the same: its lag has drifted by no more than weather and
    the air in the building allow.
    """
    air = place.air
    if air is not None:
        air = replace(air, sd_m=math.hypot(air.sd_m, drift_m(climbing, away_s)))
    pose = Pose(place.x_m, place.y_m, 0.0, place.level)
    return Start(pose, math.hypot(place.sd_m, MOVED_M), math.pi, air=air, after_pause=True)
