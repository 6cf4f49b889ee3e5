"""Beacons in the map filter: the cloud hears them, and what it believes of them is told.

In: a cloud, its last leg, the beacons' words of that leg. Out: weights, and `BeaconPlace`s. Owns how well each beacon is explained, when it was
heard, and the words of those whose place is not known yet.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from echostep.arrays import Floats
from echostep.board.gateway import BeaconReading
from echostep.localization.beacon_initialisation import found_place
from echostep.localization.beacon_slam import (
    FIT,
    HEARD,
    UNFIT_RUNS,
    BeaconSettings,
    Beliefs,
    Health,
    beacon_model,
    hear,
    kick,
    moments,
    place,
    unheard,
)
from echostep.localization.particles import Cloud
from echostep.path import PathSegment
from echostep.walls.echo_sources import Walls
from echostep.walls.index import crosses_wall

MOST_STRANGE = 60  # words that are kept of a beacon without a place
TRY_EVERY = 4  # words: then it is tried to find it
PLACED_SD_M = 0.4
SILENT_S = 8.0  # a beacon that should be heard all the time, and others are, is silent after so long
NEAR_SHARE = 0.6  # of the greatest range at which it was heard: so near, and without a wall between, it should be heard


class BeaconState(StrEnum):
    """What is known of a beacon's health."""

    WELL = "well"
    MOVED = "moved"
    SILENT = "silent"


@dataclass(frozen=True, slots=True)
class BeaconPlace:
    """Where the cloud believes a beacon to be: on the map (m), its standard deviation, axis (rad), level, and when it was last heard."""

    slot: int
    x_m: float
    y_m: float
    sd_m: float
    axis_rad: float
    level: int
    state: BeaconState
    heard_s: float


class BeaconMap:
    """All beacons that one wearer has met."""

    def __init__(self, walls: Walls, settings: BeaconSettings, rng: np.random.Generator) -> None:
        self._walls = walls
        self._settings = settings
        self._model = beacon_model(settings)
        self._rng = rng
        self._health = unheard(0)
        self._strange: dict[int, deque[tuple[float, float, float, float]]] = {}  # words of beacons without a place
        self._heard_s: list[float] = []
        self._reach_m: list[float] = []
        self._hindered_s: list[float] = []  # when it was last too far or behind a wall
        self.heard_s: float | None = None  # when any beacon was last heard

    def hear(self, cloud: Cloud, leg: PathSegment, words: Sequence[BeaconReading]) -> None:
        """Weigh the cloud, which stands at the end of a leg, by the words that were said on it."""
        length = math.hypot(leg.dx_m, leg.dy_m)
        if length > 0.0 and words:
            kick(cloud.turn_rad, cloud.log_weight, length, self._model, self._rng)
        for word in words:
            self._make_room(cloud, word.slot)
            self._heard_s[word.slot] = word.t_s
            self._reach_m[word.slot] = max(self._reach_m[word.slot], word.range_m)
            self.heard_s = word.t_s
            x, y = self._at_word(cloud, leg, word)
            if self._has_place(cloud, x, y, word):
                self._weigh(cloud, x, y, word)
                cloud.renew()
        if self._health.known.any():
            self._expect(cloud, leg.t1_s)

    def places(self, cloud: Cloud, t_s: float) -> list[BeaconPlace]:
        """Every beacon that was heard, by slot."""
        _, found = self._moments(cloud)
        known = np.flatnonzero(self._health.known).tolist()
        return [self._place(cloud, slot, found[slot].tolist(), t_s) for slot in known]

    def _moments(self, cloud: Cloud) -> tuple[tuple[float, float], Floats]:
        """Where he is on the sheet, and what `moments` says of the beacons."""
        weight = np.exp(cloud.log_weight)
        weight /= weight.sum()
        return (float(weight @ cloud.x_m), float(weight @ cloud.y_m)), moments(cloud.beliefs, weight)

    def _expect(self, cloud: Cloud, t_s: float) -> None:
        """Note which beacons cannot be expected to be heard now."""
        (x, y), found = self._moments(cloud)
        index = self._walls.index
        for slot in np.flatnonzero(self._health.known).tolist():
            bx, by = float(found[slot, 0]), float(found[slot, 1])
            far = math.hypot(bx - x, by - y) > NEAR_SHARE * self._reach_m[slot]
            if far or (len(index.walls) and crosses_wall(bx, by, x, y, index)):
                self._hindered_s[slot] = t_s

    def _place(self, cloud: Cloud, slot: int, found: list[float], t_s: float) -> BeaconPlace:
        x, y, sd, axis = found
        state = BeaconState.MOVED if self._health.each[slot, UNFIT_RUNS] else BeaconState.WELL
        others = self.heard_s is not None and t_s - self.heard_s < SILENT_S
        if others and t_s - max(self._heard_s[slot], self._hindered_s[slot]) > SILENT_S:
            state = BeaconState.SILENT
        level = cloud.level_at(x)
        return BeaconPlace(slot, x - level * cloud.pitch_m, y, sd, axis, level, state, self._heard_s[slot])

    def _at_word(self, cloud: Cloud, leg: PathSegment, word: BeaconReading) -> tuple[Floats, Floats]:
        """Where the particles were (n,), (n,) when a word of the last leg was said."""
        span_s = leg.t1_s - leg.t0_s
        back = min(max((leg.t1_s - word.t_s) / span_s, 0.0), 1.0) if span_s > 0.0 else 0.0
        c, s = np.cos(cloud.turn_rad), np.sin(cloud.turn_rad)
        x = cloud.x_m - back * cloud.scale * (c * leg.dx_m - s * leg.dy_m)
        y = cloud.y_m - back * cloud.scale * (s * leg.dx_m + c * leg.dy_m)
        return x, y

    def _has_place(self, cloud: Cloud, x: Floats, y: Floats, word: BeaconReading) -> bool:
        """Whether the particles have a belief of the beacon; one that is first heard from afar gets it after some way."""
        k = word.slot
        near = word.range_m < 2.0 * self._settings.drop_sd_m
        if self._health.known[k] or (near and k not in self._strange):
            return True
        weight = np.exp(cloud.log_weight)
        weight /= weight.sum()
        words = self._strange.setdefault(k, deque(maxlen=MOST_STRANGE))
        words.append((float(weight @ x), float(weight @ y), word.range_m, word.bearing_rad))
        if len(words) % TRY_EVERY:
            return False
        if (at := found_place(np.array(words))) is not None:
            place(cloud.beliefs, k, *at, 0.0, PLACED_SD_M**2, math.pi**2)
            self._health.known[k] = True
            self._health.each[k, FIT] = 1.0
            del self._strange[k]
        return False

    def _weigh(self, cloud: Cloud, x: Floats, y: Floats, word: BeaconReading) -> None:
        """One word; who is found elsewhere by it is moved with his way since."""
        off_x, off_y, before = cloud.x_m - x, cloud.y_m - y, self._health.each[word.slot, UNFIT_RUNS]
        index = self._walls.near(cloud.x_m, cloud.y_m, word.range_m)
        hear(
            x, y, cloud.turn_rad, cloud.log_weight, cloud.beliefs, self._health, word.slot, word.range_m, word.bearing_rad,
            self._model, self._settings.drop_sd_m**2, index, self._rng,
        )  # fmt: skip
        cloud.x_m, cloud.y_m = x + off_x, y + off_y
        if (
            self._health.each[word.slot, UNFIT_RUNS] > before
        ):  # it was moved: its new place is found like a strange one's
            self._health.known[word.slot] = False
            self._strange[word.slot] = deque(maxlen=MOST_STRANGE)

    def _make_room(self, cloud: Cloud, slot: int) -> None:
        """Room for one more beacon in the cloud and here."""
        known = len(self._heard_s)
        if slot < known:
            return
        n, more = len(cloud.x_m), slot + 1 - known
        mean, cov, doubt = cloud.beliefs
        cloud.beliefs = Beliefs(
            np.concatenate([mean, np.zeros((n, more, 3))], axis=1),
            np.concatenate([cov, np.zeros((n, more, 6))], axis=1),
            np.concatenate([doubt, np.zeros((n, more))], axis=1),
        )
        fresh, health = unheard(more), self._health
        self._health = Health(
            np.concatenate([health.each, fresh.each]), health.all, np.concatenate([health.known, fresh.known])
        )
        self._heard_s += [-math.inf] * more
        self._reach_m += [0.0] * more
        self._hindered_s += [-math.inf] * more

    def heard_times(self, slot: int) -> int:
        """Measurements of a beacon that were weighed."""
        return int(self._health.each[slot, HEARD])
