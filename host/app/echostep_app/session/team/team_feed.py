# SPDX-License-Identifier: MIT
"""The team feed: the newest place of one other wearer, of any team.

In: the team subscription. Out: payloads of chunks of the port `TEAM`, at most one a second. Owns the roster of received reports.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator

from echostep.plan.model import Plan
from echostep.ports.people.teammate import Teammate
from echostep_app.session.team.subscription import LOOK_S, TeamSubscription
from echostep_app.team.inbox import ReceivedMessage
from echostep_app.team.roster import Member, MemberState, Roster

NEWS_S = 1.0  # between two places that are passed on; assumed


class TeamFeed:
    """`pop` gives new places of the wearer."""

    def __init__(
        self, subscription: TeamSubscription, team: str, name: str, plan: Plan, print_line: Callable[[str], None]
    ) -> None:
        """`team`: the own one; it comes first where wearers of several teams have this name."""
        self._name, self._team, self._plan, self._print_line = name, team, plan, print_line
        self._roster = Roster()
        self._last: Teammate | None = None
        self._looked_s = self._told_s = -math.inf
        self._warned = False
        self._subscription = subscription
        subscription.add([f"echostep/+/{name}/+"], self._receive)

    def pop(self) -> Iterator[bytes]:
        """The wearer's place as the bytes of a chunk, when it is new; never waits."""
        now_s = time.monotonic()
        if now_s - self._looked_s < LOOK_S:
            return
        self._looked_s = now_s
        self._subscription.look()
        member = self._member(now_s)
        place = None if member is None else self._place(member, now_s)
        if place is not None and place != self._last and now_s - self._told_s >= NEWS_S:
            self._last, self._told_s = place, now_s
            yield place.encode()

    def _receive(self, message: ReceivedMessage) -> None:
        self._roster.receive(*message)

    def _member(self, now_s: float) -> Member | None:
        """The wearer of this name: of the own team before another's, running before ended, the latest heard."""
        named = [m for m in self._roster.members(now_s) if m.report.last_known is not None]
        return min(named, default=None, key=lambda m: (
            m.report.team != self._team, m.state(now_s) is MemberState.ENDED, m.silent_s(now_s),
        ))  # fmt: skip

    def _place(self, m: Member, now_s: float) -> Teammate | None:
        """Where a member is on this plan; None when it is tracked on another one, which is reported once."""
        p = m.position(now_s)
        if p is None or m.report.plan_sha256 != self._plan.digest or not 0 <= p.floor < len(self._plan.levels):
            if not self._warned:
                self._warned = True
                self._print_line(f"{self._name} is tracked on another plan ({m.report.plan}): no way can be found")
            return None
        last = "" if m.report.position else "last known"
        words = ", ".join(filter(None, (last, f"on {p.floor_name}" if p.floor_name else "", p.where)))
        # Rounded to centimetres: an unchanged place is passed on once
        return Teammate(
            m.report.name, round(p.x_m, 2), round(p.y_m, 2), p.floor, round(min(p.radius95_m, 1e7), 1), words
        )
