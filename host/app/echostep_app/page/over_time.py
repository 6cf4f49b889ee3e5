# SPDX-License-Identifier: MIT
"""A run over time: ranges, rates and heading at each estimate, and events.

In: scenes, and which of them are of new estimates, in the tracker's thread. Out: `OverTime`, which any thread may read up to a length that it has
read before. Owns the rows and the events; their number is bounded.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Iterator
from dataclasses import dataclass

from echostep.localization import TrackStatus
from echostep_app.page.elements.scene import PageScene

COLUMNS = 6  # time (s), range to the left and to the right (m), samples of the foot and pings a second, compass heading (deg); NaN: none
MOST_ROWS = 1 << 18  # 18 hours at four estimates a second, 6 MB; later ones are left out
MOST_EVENTS = 1000


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened, in words. The field names are keys of the answer's JSON."""

    t_s: float
    text: str


class OverTime:
    """Rows of float32, and events in order of time."""

    def __init__(self, levels: tuple[str, ...], north_rad: float) -> None:
        """`levels`: names of the levels. `north_rad`: direction of north, counter-clockwise from the map's x axis."""
        self._levels, self._north_rad = levels, north_rad
        self._rows = array("f")
        self.events: tuple[Event, ...] = ()  # replaced, never changed
        self._last: PageScene | None = None  # of which changes were noted
        self._row_s = -math.inf

    def __len__(self) -> int:
        return len(self._rows) // COLUMNS

    def part(self, begin: int, end: int) -> bytes:
        """Rows [begin, end)."""
        return self._rows[COLUMNS * begin : COLUMNS * end].tobytes()

    def add(self, scene: PageScene) -> None:
        """Add the scene of a new estimate."""
        if scene.estimate is None or len(self) >= MOST_ROWS:
            return
        ranges = [math.nan, math.nan]
        for line in scene.echo_lines:
            if line.t_s > self._row_s and line.measured_m is not None:
                ranges[line.ranger] = line.measured_m
        rates = (scene.streams.mtx_hz, scene.streams.pings_hz) if scene.streams else (None, None)
        known = [math.nan if rate is None else rate for rate in rates]
        bearing_deg = math.degrees(self._north_rad - scene.estimate.heading_rad) % 360.0
        heading = bearing_deg if scene.estimate.claims_place else math.nan
        self._rows.extend((scene.t_s, *ranges, *known, heading))
        self._row_s = scene.t_s

    def note(self, scene: PageScene) -> None:
        """Note the changes since the scene before; scenes between two estimates count too."""
        if scene.estimate is None:
            return
        before, self._last = self._last, scene
        if before is not None:
            new = list(self._news(before, scene))
        else:
            in_doubt = scene.estimate.status is not TrackStatus.TRACKING
            new = [Event(scene.t_s, scene.estimate.status.value)] if in_doubt else []
        if new:
            self.events = (*self.events, *new)[:MOST_EVENTS]

    def _news(self, before: PageScene, now: PageScene) -> Iterator[Event]:
        """Changes between two scenes with an estimate."""
        old, new = before.estimate, now.estimate
        assert old
        assert new
        if old.status != new.status:
            yield Event(now.t_s, new.status.value)
        if old.level != new.level:
            yield Event(now.t_s, self._levels[new.level])
        if before.streams and now.streams and now.streams.check_ins > before.streams.check_ins:
            yield Event(now.t_s, "position set by hand")
        if before.streams and now.streams and now.streams.undone > before.streams.undone:
            yield Event(now.t_s, "position set by hand: undone")
        if now.alarm and (before.alarm is None or before.alarm.kind != now.alarm.kind):
            yield Event(
                now.t_s, {"over": "alarm over", "asked": "asked after a fall"}.get(now.alarm.kind, now.alarm.kind)
            )
        if now.met and (before.met is None or before.met.number != now.met.number):
            yield Event(now.t_s, now.met.text)
