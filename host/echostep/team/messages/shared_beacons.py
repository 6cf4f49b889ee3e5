# SPDX-License-Identifier: MIT
"""Beacons that wearers share: retained messages on `echostep/<team>/<wearer>/beacons`.

In: the beacons that a tracker has placed; or the bytes of a payload from an untrusted sender. Out: topic and payload; or `TeamBeacons`. Owns nothing.
"""

from __future__ import annotations

from echostep.ports.people.team_beacons import TeamBeacons, parse_team_beacons
from echostep.team.messages.report import BadReportError, is_printable

BEACONS = "beacons"  # last part of the topic
SHARE_S = 5.0  # between two messages of a wearer, at least; assumed


def beacons_message(team: str, message: TeamBeacons) -> tuple[str, bytes]:
    """Topic and payload."""
    return f"echostep/{team}/{message.name}/{BEACONS}", message.encode()


def decode_beacons(name: str, payload: bytes) -> TeamBeacons:
    """The message in a payload on the topic of this wearer; raises BadReportError with the reason of its rejection."""
    message = parse_team_beacons(payload)
    if message is None:
        raise BadReportError("not valid beacons")
    if message.name != name:
        raise BadReportError("beacons and topic contradict each other")
    if not is_printable(message.name):
        raise BadReportError("unprintable text")
    return message
