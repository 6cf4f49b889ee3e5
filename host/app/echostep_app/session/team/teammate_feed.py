# SPDX-License-Identifier: MIT
"""The teammate feed: teammates whom the wearer may have met.

In: the team subscription; the beacons that this wearer has placed. Out: names of teammates with reports on this plan, when they change; the bytes
of a meeting with one of them, and of the beacons that they share; this wearer's own for the broker. Owns the roster of received reports.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Iterator

from echostep.aiding import MOST_TEAMMATES
from echostep.plan import Plan
from echostep.ports.people.meeting import MeetingMessage, Status
from echostep.ports.people.payloads import MOST_LEVELS
from echostep.ports.people.team_beacons import BEACONS, SHARE_S, SharedBeacon, TeamBeacons, parse_team_beacons
from echostep_app.session.team.subscription import TeamSubscription
from echostep_app.team.endpoint import Outlet
from echostep_app.team.inbox import ReceivedMessage
from echostep_app.team.messages.report import Position
from echostep_app.team.roster import Member, MemberState, Roster

KNOWN: dict[str, Status] = {"tracking": "tracking", "uncertain": "uncertain"}  # any other state carries no position


def meeting_with(
    name: str, status: str, p: Position, measured: tuple[float, float] | None = None
) -> MeetingMessage | None:
    """A meeting with a teammate, from its report; None on a floor that no plan has. `measured`: a radio range and its standard deviation (m)."""
    if not 0 <= p.floor < MOST_LEVELS:
        return None
    range_m, range_sd_m = (None, 0.0) if measured is None else measured
    return MeetingMessage(
        name, KNOWN.get(status, "lost"), p.x_m, p.y_m, p.floor, p.xx_m2, p.xy_m2, p.yy_m2, p.age_s, p.floor_probability, range_m, range_sd_m,
    )  # fmt: skip


LISTED_S = 60.0  # a teammate without a report for longer is not listed; assumed


class TeammateFeed:
    """`news` gives the names when they have changed, `meetings` and `beacons` the bytes of chunks; rejected reports are counted in `rejected`."""

    def __init__(self, subscription: TeamSubscription, outlet: Outlet, run: str, plan: Plan) -> None:
        """`run`: of this wearer; beacons placed by an earlier run under the same name are taken like a teammate's."""
        self._own, self._run, self._plan = (outlet.team, outlet.name), run, plan
        self._roster = Roster()
        self.rejected = self._roster.rejected
        self._names: tuple[str, ...] = ()
        self._shared_s = -math.inf
        self._placed: dict[str, bytes] = {}  # newest beacons of each teammate that were not taken yet, by name
        self._taken: dict[str, tuple[float, bytes]] = {}  # those that were taken, and when
        self._shared = b""
        self._subscription = subscription
        self._looks = subscription.add([f"echostep/{outlet.team}/+/+"], self._receive)

    def news(self) -> tuple[str, ...] | None:
        """Names of the teammates, sorted; None when they are the same as before. Never waits."""
        if not self._looks() or (names := tuple(sorted(self._members(time.monotonic())))) == self._names:
            return None
        self._names = names
        return names

    def meetings(self, names: Iterable[str]) -> Iterator[bytes]:
        """A meeting now with each of these teammates, by its newest report; nothing for a name without a report."""
        for name in names:
            if payload := self._meeting(name):
                yield payload

    def _meeting(self, name: str) -> bytes | None:
        now_s = time.monotonic()
        member = self._members(now_s).get(name)
        position = None if member is None else member.at(now_s).last_known
        if member is None or position is None or not 0 <= position.floor < len(self._plan.levels):
            return None
        met = meeting_with(name, member.at(now_s).status, position)
        return None if met is None else met.encode()

    def beacons(self) -> list[bytes]:
        """New messages of teammates who have placed beacons on this plan, as bytes of chunks; of each teammate one in SHARE_S."""
        if not self._placed:
            return []
        now_s = time.monotonic()
        due = [name for name in self._placed if now_s - self._taken.get(name, (-math.inf, b""))[0] >= SHARE_S]
        self._taken |= {name: (now_s, self._placed[name]) for name in due}
        return [self._placed.pop(name) for name in due]

    def share(self, own_beacons: Callable[[], tuple[SharedBeacon, ...] | None]) -> None:
        """Publish the beacons that this wearer has placed, every SHARE_S when they have changed; None: they are unknown at present."""
        now_s = time.monotonic()
        if now_s - self._shared_s < SHARE_S or (beacons := own_beacons()) is None:
            return
        message = TeamBeacons(1, self._own[1], self._run, self._plan.digest, beacons)
        topic, payload = message.topic(self._own[0]), message.encode()
        if payload != self._shared and (beacons or self._shared) and self._subscription.send(topic, payload):
            self._shared, self._shared_s = payload, now_s

    def _members(self, now_s: float) -> dict[str, Member]:
        """The run with the newest report of each teammate with a position on this plan, by name."""
        self._subscription.look()
        members = [
            m for m in self._roster.members(now_s)
            if (m.report.team, m.report.name) != self._own and m.report.position is not None
            and m.report.plan_sha256 == self._plan.digest and m.silent_s(now_s) < LISTED_S
            and m.state(now_s) is not MemberState.ENDED
        ]  # fmt: skip
        return {m.report.name: m for m in sorted(members, key=lambda m: -m.silent_s(now_s))}

    def _receive(self, message: ReceivedMessage) -> None:
        """Update the roster with a message, or note its beacons."""
        if self._roster.receive(*message) and message.topic is not None and message.topic.endswith(f"/{BEACONS}"):
            self._note_beacons(message.payload)

    def _note_beacons(self, payload: bytes) -> None:
        message = parse_team_beacons(payload)
        if message is None or message.run == self._run or message.plan_sha256 != self._plan.digest:
            return
        names = self._placed.keys() | self._taken.keys()
        if message.name not in names and len(names) >= MOST_TEAMMATES:
            self._roster.count_rejected(f"beacons of more than {MOST_TEAMMATES} wearers")
        elif payload != self._taken.get(message.name, (0.0, b""))[1]:
            self._placed[message.name] = payload
