# SPDX-License-Identifier: MIT
"""The teammates' ear: whom a wearer can have met, from the broker that a run publishes to.

In: reports of the own team. Out: names of teammates who are heard on this plan, when they change; the bytes of a `Meeting` with one of them. Owns the
subscription, its thread and the roster of what was heard; the tracker never waits for it.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace

from echostep.plan.model import Plan
from echostep.team.commander import update_roster
from echostep.team.endpoint import Endpoint, Outlet
from echostep.team.inbox import Inbox, Receiver
from echostep.team.meeting import meeting_with
from echostep.team.mqtt import Listener
from echostep.team.roster import Member, MemberState, Roster

LOOK_S = 0.5  # between two looks at what was heard, by reason
HEARD_S = 60.0  # a teammate who has been silent for longer is not listed, by reason


class TeammatesEar:
    """`news` gives the names when they have changed, `meeting` the bytes of a chunk; reports that are not believed are counted in `rejected`."""

    def __init__(self, broker: Endpoint, outlet: Outlet, plan: Plan, print_line: Callable[[str], None]) -> None:
        self._own, self._plan = (outlet.team, outlet.name), plan
        self._inbox, self._roster = Inbox(), Roster()
        self.rejected = self._roster.rejected
        self._names: tuple[str, ...] = ()
        self._looked_s = -math.inf
        listener = Listener(broker, [f"echostep/{outlet.team}/+/+"], self._inbox.put)
        self._receiver = Receiver(listener, lambda text: print_line(f"{broker}: teammates: {text}"))

    def news(self) -> tuple[str, ...] | None:
        """Names of the teammates, sorted; None when they are the same as before. Never waits."""
        now_s = time.monotonic()
        if now_s - self._looked_s < LOOK_S:
            return None
        self._looked_s = now_s
        names = tuple(sorted(self._members(now_s)))
        if names == self._names:
            return None
        self._names = names
        return names

    def meeting(self, name: str) -> bytes | None:
        """A meeting with a teammate now, by the newest report; None when none is heard by this name."""
        now_s = time.monotonic()
        member = self._members(now_s).get(name)
        position = None if member is None else member.position(now_s)
        if member is None or position is None or not 0 <= position.floor < len(self._plan.levels):
            return None
        position = replace(position, age_s=member.report.position.age_s + member.silent_s(now_s))  # type: ignore[union-attr]
        met = meeting_with(name, member.report.status, position)
        return None if met is None else met.encode()

    def close(self) -> None:
        """End the subscription."""
        self._receiver.close()

    def _members(self, now_s: float) -> dict[str, Member]:
        """The latest heard run of each teammate who has a position on this plan, by name."""
        update_roster(self._inbox, self._roster)
        heard = [
            m for m in self._roster.members(now_s)
            if (m.report.team, m.report.name) != self._own and m.report.position is not None
            and m.report.plan_sha256 == self._plan.digest and m.silent_s(now_s) < HEARD_S
            and m.state(now_s) is not MemberState.ENDED
        ]  # fmt: skip
        return {m.report.name: m for m in sorted(heard, key=lambda m: -m.silent_s(now_s))}
