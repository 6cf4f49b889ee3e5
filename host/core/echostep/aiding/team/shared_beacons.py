# SPDX-License-Identifier: MIT
"""Beacons that teammates have placed, as this wearer's filter uses them.

In: messages of teammates (`TeamBeacons`), readings of this wearer's gateway, the beacons that this wearer has placed. Out: a `Meeting` of each
reading of a teammate's beacon, a range from the place that the teammate reported; `SharedBeacon`s of the wearer's own. Owns the newest message of
each teammate, and the count of invalid messages.

Such a range is fused as a radio range (`meeting_model`): by covariance intersection, for the beacon's error is its teammate's, which may be this
wearer's own. One reading in five is an outlier (`BeaconSettings.range_outliers`), as often as a meeting with an `uncertain` teammate is wrong. A
reading of a beacon that k teammates report is a range to each of these places, but one measurement: each range has the power 1/k.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from echostep.aiding.beacon_map import BeaconMap
from echostep.aiding.team.meeting import Meeting, TimedMeeting
from echostep.board.gateway import BeaconReading
from echostep.localization.particles.particles import Particles
from echostep.ports.people.team_beacons import SharedBeacon, parse_team_beacons

MOST_TEAMMATES = 64  # whose beacons are kept, the newest, assumed
TEAM_RANGE_SD_M = 0.4  # of a range to the trunk: BeaconSettings.range_sd_m, for the same reasons
SHARED_SD_M = 1.0  # per axis, of a place above which a beacon is not shared: it has less information than the echoes
ROUNDING_M2 = 2e-4  # added to the variances of a shared place, which is rounded to 0.01 m


def shared_beacons(
    beacon_map: BeaconMap, cloud: Particles, t_s: float, numbers: Sequence[int]
) -> tuple[SharedBeacon, ...]:
    """The beacons that a cloud has placed, to be sent to teammates; `numbers`: of the beacon in each slot."""
    shared = []
    for place in beacon_map.places(cloud, t_s):
        if place.sd_m > SHARED_SD_M:
            continue
        (xx, xy), (_, yy) = beacon_map.covariance(cloud, place.slot).tolist()
        x_m, y_m = round(place.x_m, 2), round(place.y_m, 2)
        spread = (round(xx + ROUNDING_M2, 4), round(xy, 4), round(yy + ROUNDING_M2, 4))
        shared.append(SharedBeacon(numbers[place.slot], x_m, y_m, place.level, *spread))
    return tuple(shared)


class TeamBeaconMap:
    """`reported`: the beacons of each teammate by number. `counts`: messages `believed`, and `bad` ones."""

    def __init__(self) -> None:
        self.reported: dict[str, dict[int, SharedBeacon]] = {}
        self.counts: Counter[str] = Counter()

    def receive(self, payload: bytes, levels: int) -> None:
        """Take one message, on a plan of `levels` levels; other bytes are counted."""
        message = parse_team_beacons(payload)
        if message is None or any(b.level >= levels for b in message.beacons):
            self.counts["bad"] += 1
            return
        self.counts["believed"] += 1
        self.reported.pop(message.name, None)
        self.reported[message.name] = {b.number: b for b in message.beacons}
        if len(self.reported) > MOST_TEAMMATES:
            self.reported.pop(next(iter(self.reported)))

    def ranges(self, readings: Sequence[BeaconReading], numbers: Sequence[int]) -> list[TimedMeeting]:
        """Ranges by the readings of beacons whose place a teammate reports, with their times; `numbers`: of the beacon in each slot."""
        meetings: list[TimedMeeting] = []
        for reading in readings if self.reported else ():
            number = numbers[reading.slot]
            reports = {name: beacons[number] for name, beacons in self.reported.items() if number in beacons}
            for name, b in reports.items():
                place = b.x_m, b.y_m, b.level, b.xx_m2, b.xy_m2, b.yy_m2
                at = Meeting(
                    name,
                    "uncertain",
                    *place,
                    range_m=reading.range_m,
                    range_sd_m=TEAM_RANGE_SD_M,
                    beacon=b.number,
                    share=1.0 / len(reports),
                )
                meetings.append((reading.t_s, at))
        return meetings
