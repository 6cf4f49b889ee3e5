# SPDX-License-Identifier: MIT
"""The start as a distribution: about a pose, in a room, or anywhere on the walkable floor.

In: a `Start`. Out: poses drawn from it. Owns nothing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.height.levels import UNKNOWN_LAG_M2, Air
from echostep.localization.settings import UNPLANNED_DOOR
from echostep.plan import ANY_LEVEL, Level, Pose
from echostep.walls.floor import Floor
from echostep.walls.index import NO_WALLS, WallIndex, crossings
from echostep.walls.level_sheet import LevelSheet, level_of

# The place or the heading of a stated start is sometimes wrong: a tap beside it, a body that does not face the way the toes point. Assumed:
STATED = 0.99  # probability that either is right: its spread is never all that is possible
# Standard deviations of a wrong one besides the stated ones: a stride, a foot that is set down turned
WIDE_SD_M, WIDE_SD_RAD = 0.9, math.radians(30.0)
WIDE_SHARE = 0.07  # of the particles have either wrong: enough to be found by the first echoes
HEARD_M = 5.0  # of a wall, within which it places the wearer: the rangers' reach without a second reflection
TURN_AROUND_RAD = 1.5  # a heading with a greater standard deviation is drawn evenly from all


@dataclass(frozen=True, slots=True)
class Start:
    """Where the trunk may be at the beginning.

    `pose`: its mean, with a standard deviation `sd_m` per axis and `heading_sd_rad`; a pose with level ANY_LEVEL may be on any. Without a pose:
    evenly over the walkable floor, on any level and with any heading, within the outline `room_m` (k, 2) on `level` if given; a share of them
    `near` a pose, if given, with these deviations: with level ANY_LEVEL, above and below it too. `air`: calibration of the heights by pressure.
    `after_pause`: an earlier run ended at the pose, and the wearer may have gone on since, so the whole building is searched beside it.

    >>> import echostep
    >>> echostep.Start()  # anywhere in the building
    Start()
    >>> at_the_door = echostep.Start(echostep.plan.Pose(2.0, 7.5, 0.0), sd_m=0.3)
    >>> at_the_door
    Start(pose=Pose(x_m=2.0, y_m=7.5, heading_rad=0.0, level=0), sd_m=0.3)
    >>> echostep.replay("walk.mcap", "demo.json", start=at_the_door)
    <Walk 'walk.mcap': 5 estimates, 2.0 s, 100% tracking, on 'Demo office'>
    """

    pose: Pose | None = None
    sd_m: float = 0.15
    heading_sd_rad: float = math.radians(5.0)
    room_m: Floats | None = None
    level: int = ANY_LEVEL
    near: Pose | None = None
    air: Air | None = None
    after_pause: bool = False

    @property
    def is_on_any_level(self) -> bool:
        """Whether nothing is known of the level."""
        return self.pose is None and self.level == ANY_LEVEL and self.air is None

    @property
    def lag_variance(self) -> float:
        """Variance (m2) of the offset of the height by pressure."""
        return UNKNOWN_LAG_M2 if self.air is None else self.air.sd_m**2

    def draw(
        self, count: int, floor: Floor, sheet: LevelSheet | None, rng: np.random.Generator, walls: WallIndex = NO_WALLS
    ) -> tuple[Floats, Floats, Floats, Floats]:
        """x, y on the sheet (m), heading (rad) and log-weight, each (count,); behind a wall from a pose is as improbable as a way through it."""
        if self.pose is None:
            heading, allowed = 2.0 * math.pi * rng.random(count), allowed_floor(floor, self, sheet)
            x, y = allowed.draw(count, rng) if len(allowed.x_m) else np.zeros((2, count))
            return x, y, heading, np.zeros(count)
        is_wide = rng.random((2, count)) < (
            WIDE_SHARE if len(floor.x_m) else 0.0
        )  # without walls nothing would correct it
        pose, wrong, noise = self.pose, wide(self), rng.standard_normal((3, count))
        sd_m = np.where(is_wide[0], wrong.sd_m, self.sd_m)
        sd_rad = np.where(is_wide[1], wrong.heading_sd_rad, self.heading_sd_rad)
        x, y = pose.x_m + sd_m * noise[0], pose.y_m + sd_m * noise[1]
        heading = pose.heading_rad + sd_rad * noise[2]
        if self.heading_sd_rad > TURN_AROUND_RAD:
            heading = 2.0 * math.pi * rng.random(count)
        east = np.full(count, pose.x_m)
        if sheet is not None:
            on_sheet = _levels(pose.level, count, sheet) * sheet.pitch_m
            x, east = x + on_sheet, east + on_sheet
        log_weight = np.where(
            is_wide, math.log((1.0 - STATED) / WIDE_SHARE), math.log(STATED / (1.0 - WIDE_SHARE))
        ).sum(0)
        is_behind = crossings(east, np.full(count, pose.y_m), x, y, walls)
        return x, y, heading, log_weight + UNPLANNED_DOOR * is_behind

    def __repr__(self) -> str:
        """The fields that are not the default."""
        given = [(f.name, getattr(self, f.name)) for f in fields(self) if getattr(self, f.name) is not f.default]
        words = [f"room_m=<{len(value)} corners>" if name == "room_m" else f"{name}={value!r}" for name, value in given]
        return f"Start({', '.join(words)})"


def wide(start: Start) -> Start:
    """The start if the stated one is wrong: near its pose, if any."""
    sd_m, sd_rad = math.hypot(start.sd_m, WIDE_SD_M), math.hypot(start.heading_sd_rad, WIDE_SD_RAD)
    return Start(near=start.pose, sd_m=sd_m, heading_sd_rad=sd_rad)


def _levels(level: int, count: int, sheet: LevelSheet) -> Ints:
    """The level of each of `count` particles: the given one, or all in turn."""
    return np.arange(count) % len(sheet.height_m) if level == ANY_LEVEL else np.full(count, level)


def allowed_floor(floor: Floor, start: Start, sheet: LevelSheet | None) -> Floor:
    """The cells of the floor that a start without a pose allows; all of them if a room has none."""
    level = np.zeros(len(floor.x_m), np.int64) if sheet is None else level_of(floor.x_m, sheet)
    allowed = np.ones(len(level), np.bool_) if start.level == ANY_LEVEL else level == start.level
    if start.room_m is not None:
        import shapely

        map_x = floor.x_m - (0.0 if sheet is None else level * sheet.pitch_m)
        allowed &= np.asarray(shapely.contains_xy(shapely.Polygon(start.room_m), map_x, floor.y_m))
    return Floor(floor.x_m[allowed], floor.y_m[allowed], floor.enclosed[allowed]) if allowed.any() else floor


class DrawnPlaces:
    """How well places of a drawing are known in the building: the drawing's own error, added to the error of a place on it.

    A shift of the drawing about a wearer makes no echo fit worse, so no echo reveals it: it widens the claimed errors, and a start that was known in
    the building. Plans that state none are taken as exact.
    """

    def __init__(self, levels: Sequence[Level] = ()) -> None:
        self._places = tuple(level.place_sd for level in levels)
        self.are_stated = any(len(rows) for rows in self._places)

    def sd_m(self, x_m: float, y_m: float, level: int) -> float:
        """Standard deviation per axis of the drawing about a place: the largest of the walls in range there, or the nearest one's."""
        rows = self._places[level] if 0 <= level < len(self._places) else np.zeros((0, 3))
        if not len(rows):
            return 0.0
        away_m: Floats = np.hypot(rows[:, 0] - x_m, rows[:, 1] - y_m)
        near = away_m < max(HEARD_M, float(away_m.min()) + 1e-9)
        return float(rows[near, 2].max())

    def widened(self, start: Start) -> Start:
        """A start that is known in the building, as a start on the drawing."""
        if not self.are_stated or start.pose is None or start.pose.level == ANY_LEVEL:
            return start
        sd_m = self.sd_m(start.pose.x_m, start.pose.y_m, start.pose.level)
        return replace(start, sd_m=math.hypot(start.sd_m, sd_m)) if sd_m else start
