# SPDX-License-Identifier: MIT
"""The beacon gateway: its bytes -> readings of beacons, on the tracker's clock.

In: bytes of the gateway's port, and the tracker's time when they arrive. Out: `BeaconReading`s in order of arrival. Owns the frame reader, the slot
of each beacon and the counts. No bytes raise an error: a rejected message is counted by reason.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from echostep.board.frames import BoardReader, StaleFirmwareError
from echostep.board.messages import BEACON_BEARING_INVALID, BEACON_RANGE_MM_INVALID, Beacon

MOST_BEACONS = 64  # assumed: more than a team drops
NEAREST_M, FURTHEST_M = 0.0, 30.0  # limits of a range: ultrasound does not reach farther
OLDEST_S = 1.0  # greatest age of a reading; assumed
LEAST_INTERVAL_S = 0.045  # least time between two readings of a beacon: a beacon measures at most 20 times a second
CLOCK_S = 1.0  # largest jump of the gateway's clock relative to the tracker's between two messages; assumed
CLOCK_GAIN = 0.05  # of a message in the running mean of the gateway's clock offset; assumed
NEW_CLOCK_MESSAGES = 10  # consecutive messages that agree on a new clock offset before it is accepted; assumed
# A beacon with at most this many readings gives up its slot after this time without a reading: invented numbers
FEW_READINGS, FEW_S = 5, 60.0
FORGOTTEN_S = 1800.0  # any beacon gives it up after this time: it is out of power or out of the building
LARGEST_BEARING_DEG = 180.0


class BeaconReading(NamedTuple):
    """Measurement of the beacon in a slot at `t_s`: range (m), bearing from the beacon's axis (rad, NaN: not measured)."""

    t_s: float
    slot: int
    range_m: float
    bearing_rad: float


@dataclass(slots=True)
class GatewayCounts:
    """Accepted readings (`words`), and rejected messages by reason."""

    words: int = 0
    early: int = 0  # before the tracker has a time
    impossible_ranges: int = 0
    impossible_bearings: int = 0
    duplicate_numbers: int = 0  # from another unit with the number of a known beacon
    clock_jumps: int = 0  # of the gateway's clock
    late: int = 0  # too old, or while a jump of the gateway's clock is not confirmed
    flood: int = 0  # more often than a beacon can measure
    too_many: int = 0  # from a beacon beyond MOST_BEACONS
    foreign: int = 0  # frames of other messages
    broken: int = 0  # frames that failed a check
    lost: int = 0  # frames that never came


class Gateway:
    """Reader of the gateway's bytes, which must come in order of arrival."""

    def __init__(self) -> None:
        self.numbers: list[int] = []  # of the beacon in each slot
        self.duplicates: set[int] = set()  # numbers that two units use
        self._slots: dict[int, int] = {}  # slot by the beacon's number
        self._units: dict[int, int] = {}  # unit by the beacon's number
        self._last_s: dict[int, float] = {}  # time of the last reading by slot
        self._readings: dict[int, int] = {}  # number of readings by slot
        self._reader = BoardReader()
        self._counts = GatewayCounts()
        self._offset_s = math.nan  # gateway's time minus the tracker's
        self._new_offset_s = math.nan  # of the newest message with a jump
        self._agreeing = 0  # consecutive messages that agree on the new offset

    @property
    def counts(self) -> GatewayCounts:
        """Counts since the start."""
        frames = self._reader.counts
        self._counts.broken, self._counts.lost = frames.rejected, frames.lost
        return self._counts

    def read(self, received: bytes, now_s: float) -> list[BeaconReading]:
        """Readings in these bytes; `now_s`: the tracker's time, NaN before it has one."""
        try:
            frames = self._reader.frames(received)
        except StaleFirmwareError:  # a board's identity at a gateway's port
            self._counts.foreign += 1
            self._reader = BoardReader()
            return []
        frame_index, rows = frames.rows(Beacon)
        self._counts.foreign += len(frames.id) - len(frame_index)
        return [read for row in rows if (read := self._reading(Beacon._make(row.tolist()), now_s)) is not None]

    def _reading(self, beacon: Beacon, now_s: float) -> BeaconReading | None:
        """The reading of a message; None, and counted, if a check fails."""
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
        elif abs(bearing) > LARGEST_BEARING_DEG:
            counts.impossible_bearings += 1
            return None
        t_s = now_s - 1e-3 * beacon.age_ms
        if not self._clock_continues(1e-3 * beacon.gateway_ms - now_s) or 1e-3 * beacon.age_ms > OLDEST_S:
            counts.late += 1
            return None
        return self._with_slot(beacon, BeaconReading(t_s, 0, range_m, math.radians(bearing)))

    def _with_slot(self, beacon: Beacon, reading: BeaconReading) -> BeaconReading | None:
        """The reading with its beacon's slot; None, and counted, for a duplicate number, one beacon too many, or a reading too soon."""
        counts = self._counts
        if self._units.get(beacon.number, beacon.unit) != beacon.unit:
            counts.duplicate_numbers += 1
            self.duplicates.add(beacon.number)
            return None
        if beacon.number not in self._slots:
            slot = self._free_slot(reading.t_s)
            if slot is None:
                counts.too_many += 1
                return None
            self._slots[beacon.number], self._units[beacon.number] = slot, beacon.unit
            self.numbers[slot:] = [beacon.number, *self.numbers[slot + 1 :]]
        slot = self._slots[beacon.number]
        if abs(reading.t_s - self._last_s.get(slot, -math.inf)) < LEAST_INTERVAL_S:
            counts.flood += 1
            return None
        self._last_s[slot] = reading.t_s
        self._readings[slot] = self._readings.get(slot, 0) + 1
        counts.words += 1
        return reading._replace(slot=slot)

    def _free_slot(self, t_s: float) -> int | None:
        """The next slot; when all are in use, the slot of the beacon that has been silent longest, or None if its last reading is too recent."""
        if len(self.numbers) < MOST_BEACONS:
            return len(self.numbers)
        waits_s = {
            slot: last_s + (FEW_S if self._readings[slot] <= FEW_READINGS else FORGOTTEN_S)
            for slot, last_s in self._last_s.items()
        }
        slot = min(waits_s, key=lambda slot: waits_s[slot])
        if waits_s[slot] > t_s:
            return None
        number = self.numbers[slot]
        del self._slots[number], self._units[number], self._last_s[slot], self._readings[slot]
        self.duplicates.discard(number)
        return slot

    def _clock_continues(self, offset_s: float) -> bool:
        """Whether the gateway's clock is continuous; `offset_s`: its time minus the tracker's, by the newest message.

        A jump means messages that the gateway has delayed, or a restart. A new offset is accepted when NEW_CLOCK_MESSAGES in a row agree on it.
        """
        if math.isnan(self._offset_s):
            self._offset_s = offset_s
        jump_s = offset_s - self._offset_s
        if abs(jump_s) <= CLOCK_S:
            self._offset_s += CLOCK_GAIN * jump_s
            self._agreeing = 0
            return True
        self._agreeing = self._agreeing + 1 if abs(offset_s - self._new_offset_s) <= CLOCK_S else 1
        self._new_offset_s = offset_s
        if self._agreeing < NEW_CLOCK_MESSAGES:
            return False
        self._counts.clock_jumps += 1
        self._offset_s, self._agreeing = offset_s, 0
        return True
