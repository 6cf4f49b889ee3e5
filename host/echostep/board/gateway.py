"""The beacon gateway: its bytes -> what beacons measured, each on the tracker's time.

In: bytes of the gateway's port, and how far the tracker's time has come when they arrive. Out: `BeaconReading`s in the order of arrival. Owns the
reader, which beacon has which slot, and the counts of what was not believed. Nothing that a gateway says can stop it: every refusal has a name and
a number.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from echostep.board.frames import BoardReader, StaleFirmwareError
from echostep.board.messages import BEACON_BEARING_INVALID, BEACON_RANGE_MM_INVALID, BY_ID, Beacon

MOST_BEACONS = 64
NEAREST_M, FURTHEST_M = 0.0, 30.0  # beyond it no ultrasound is heard
OLDEST_S = 1.0
GAP_S = 0.045  # a beacon that speaks more often than 20 times a second floods
CLOCK_S = 1.0  # a gateway's clock may wander so far from the tracker's between two words
SETTLED = 10  # words in a row that agree on a new clock
_BEACON = next(identifier for identifier, kind in BY_ID.items() if kind is Beacon)


class BeaconReading(NamedTuple):
    """What the beacon in a slot measured at `t_s`: range (m), bearing from its axis (rad, NaN: not measured)."""

    t_s: float
    slot: int
    range_m: float
    bearing_rad: float


@dataclass(slots=True)
class GatewayCounts:
    """Words that were believed, and why others were not."""

    words: int = 0
    early: int = 0  # before the tracker had a time
    impossible_ranges: int = 0
    impossible_bearings: int = 0
    duplicate_numbers: int = 0  # of another unit under a number that is taken
    clock_jumps: int = 0  # of the gateway's clock
    late: int = 0  # too old, or while the gateway's clock was in doubt
    flood: int = 0  # more often than a beacon can measure
    too_many: int = 0  # of a beacon beyond the most that are known
    foreign: int = 0  # frames that are no beacon's
    broken: int = 0  # what is no frame
    lost: int = 0  # frames that never came


class Gateway:
    """Feed it the gateway's bytes in order of arrival."""

    def __init__(self) -> None:
        self.numbers: list[int] = []  # of the beacon in each slot
        self.duplicates: set[int] = set()  # numbers that two units claim
        self._slots: dict[int, int] = {}
        self._units: dict[int, int] = {}
        self._last_s: dict[int, float] = {}
        self._reader = BoardReader()
        self._counts = GatewayCounts()
        self._clock_s = math.nan  # gateway's time less the tracker's
        self._doubt_s = math.nan
        self._agree = 0

    @property
    def counts(self) -> GatewayCounts:
        """What was seen so far."""
        frames = self._reader.counts
        self._counts.broken, self._counts.lost = frames.rejected, frames.lost
        return self._counts

    def read(self, received: bytes, now_s: float) -> list[BeaconReading]:
        """Words in these bytes; `now_s`: the tracker's time, NaN before it has one."""
        try:
            frames = self._reader.frames(received)
        except StaleFirmwareError:  # a board's identity at a gateway's port
            self._counts.foreign += 1
            self._reader = BoardReader()
            return []
        place, rows = frames.rows(_BEACON)
        self._counts.foreign += len(frames.id) - len(place)
        words = (self._word(Beacon._make(row.tolist()), now_s) for row in rows)
        return [word for word in words if word is not None]

    def describe(self) -> str:
        """The counts in words, those that are not zero."""
        counts = self.counts
        parts = [
            f"{value} {name.replace('_', ' ')}"
            for name in counts.__dataclass_fields__
            if name != "words" and (value := getattr(counts, name))
        ]
        refused = f"; not believed: {', '.join(parts)}" if parts else ""
        twice = (
            f"; two beacons call themselves {', '.join(map(str, sorted(self.duplicates)))}" if self.duplicates else ""
        )
        return f"beacons: {len(self.numbers)} heard, {counts.words} words{refused}{twice}"

    def _word(self, beacon: Beacon, now_s: float) -> BeaconReading | None:
        """A message as a word, if it can be believed."""
        counts = self._counts
        if math.isnan(now_s):
            counts.early += 1
            return None
        range_m, bearing = 1e-3 * beacon.range_mm, 1e-2 * beacon.bearing
        if beacon.range_mm == BEACON_RANGE_MM_INVALID or not NEAREST_M < range_m <= FURTHEST_M:
            counts.impossible_ranges += 1
            return None
        if beacon.bearing == BEACON_BEARING_INVALID:
            bearing = math.nan
        elif abs(bearing) > 180.0:
            counts.impossible_bearings += 1
            return None
        t_s = now_s - 1e-3 * beacon.age_ms
        if not self._on_time(1e-3 * beacon.gateway_ms - now_s) or 1e-3 * beacon.age_ms > OLDEST_S:
            counts.late += 1
            return None
        return self._of_known(beacon, BeaconReading(t_s, 0, range_m, math.radians(bearing)))

    def _of_known(self, beacon: Beacon, word: BeaconReading) -> BeaconReading | None:
        """The word with its beacon's slot, unless the beacon is not what it says or speaks too often."""
        counts = self._counts
        if self._units.get(beacon.number, beacon.unit) != beacon.unit:
            counts.duplicate_numbers += 1
            self.duplicates.add(beacon.number)
            return None
        if beacon.number not in self._slots:
            if len(self.numbers) >= MOST_BEACONS:
                counts.too_many += 1
                return None
            self._slots[beacon.number] = len(self.numbers)
            self._units[beacon.number] = beacon.unit
            self.numbers.append(beacon.number)
        slot = self._slots[beacon.number]
        if abs(word.t_s - self._last_s.get(slot, -math.inf)) < GAP_S:
            counts.flood += 1
            return None
        self._last_s[slot] = word.t_s
        counts.words += 1
        return word._replace(slot=slot)

    def _on_time(self, clock_s: float) -> bool:
        """Whether the gateway's clock goes on as before.

        A step back is a gateway that kept words for itself, or one that restarted: only when several words agree on it is it the new clock.
        """
        if math.isnan(self._clock_s):
            self._clock_s = clock_s
        off = clock_s - self._clock_s
        if abs(off) <= CLOCK_S:
            self._clock_s += 0.05 * off
            self._agree = 0
            return True
        self._agree = self._agree + 1 if abs(clock_s - self._doubt_s) <= CLOCK_S else 1
        self._doubt_s = clock_s
        if self._agree < SETTLED:
            return False
        self._counts.clock_jumps += 1
        self._clock_s, self._agree = clock_s, 0
        return True
