# SPDX-License-Identifier: MIT
"""A run's other input from the team: the newest place of one wearer; the commanders' marks, acknowledgements, errands.

In: the team subscription. Out: payloads of chunks of the port `TEAM`, at most one a second; marks on this plan, when they change; names of
commanders; an errand, when it is new. Owns the roster of received reports, and the board of received marks.
"""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable, Iterator

from echostep.plan import Plan
from echostep_app.page.elements.marks import ShownMark, ShownOrder
from echostep_app.ports.teammate import Teammate
from echostep_app.session.team.subscription import TeamSubscription
from echostep_app.team.endpoint import Outlet
from echostep_app.team.inbox import ReceivedMessage
from echostep_app.team.messages.marks import MARKS, Errand, MarkBoard, acks_of, errand_of
from echostep_app.team.messages.orders import (
    EVERYBODY,
    HOLDS_S,
    NOTE,
    ORDERS,
    RECEIPTS,
    Receipt,
    receipt_message,
)
from echostep_app.team.messages.report import BadReportError
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
        self._told_s = -math.inf
        self._warned = False
        self._looks = subscription.add([f"echostep/+/{name}/+"], self._receive)

    def pop(self) -> Iterator[bytes]:
        """The wearer's place as the bytes of a chunk, when it is new; never waits."""
        if not self._looks():
            return
        now_s = time.monotonic()
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
        r = m.at(now_s)
        if (
            (p := r.last_known) is None
            or m.report.plan_sha256 != self._plan.digest
            or not 0 <= p.floor < len(self._plan.levels)
        ):
            if not self._warned:
                self._warned = True
                self._print_line(f"{self._name} is tracked on another plan ({m.report.plan}): no way can be found")
            return None
        last = "" if r.position else "last known"
        words = ", ".join(filter(None, (last, f"on {p.floor_name}" if p.floor_name else "", p.where)))
        # Rounded to centimetres: an unchanged place is passed on once
        return Teammate(
            m.report.name, round(p.x_m, 2), round(p.y_m, 2), p.floor, round(min(p.radius95_m, 1e7), 1), words
        )


class MarkFeed:
    """`news` gives the marks when they have changed; rejected messages are counted in `rejected`."""

    def __init__(self, subscription: TeamSubscription, outlet: Outlet, run: str, plan_sha256: str) -> None:
        """`outlet`, `run`: under which names this wearer's alarms are published."""
        self.rejected: Counter[str] = Counter()
        self._key = outlet.team, outlet.name, run
        self._plan_sha256 = plan_sha256
        self._board = MarkBoard()
        self._shown: tuple[ShownMark, ...] = ()
        self._errand: Errand | None = None  # the last one that was given
        own = outlet.team, outlet.name
        topics = [MARKS, *acks_of(*own), errand_of(self._key), f"{ORDERS}/{EVERYBODY}", f"{ORDERS}/{'/'.join(own)}"]
        topics.append(f"{RECEIPTS}/+/{'/'.join(own)}")
        self._send = subscription.send
        self._looks = subscription.add(topics, self._receive)

    def news(self) -> tuple[ShownMark, ...] | None:
        """All marks on this plan; None when they are the same as before. Never waits."""
        if not self._looks():
            return None
        marks = [m for m in self._board.marks.values() if m.plan_sha256 == self._plan_sha256]
        shown = tuple(ShownMark(m.id, m.mark, m.x_m, m.y_m, m.level, m.by) for m in marks)
        if shown == self._shown:
            return None
        self._shown = shown
        return shown

    def answer_to(self, number: int) -> str:
        """Who has the mayday of this number, as of the last call of `news`: a person, a commander's computer; empty while it has neither."""
        team, name, run = self._key
        key = team, name, f"{run}-{number}"
        if ack := self._board.acks.get(key):
            return f"{ack.by} has acknowledged it."
        return "A commander's screen shows it; no acknowledgement has come yet." if key in self._board.seen else ""

    def new_errand(self) -> Errand | None:
        """The errand of this wearer on this plan by a commander, as of the last call of `news`; each errand is given once."""
        errand = self._board.errands.get(self._key)
        if errand is None or errand == self._errand or errand.plan_sha256 != self._plan_sha256:
            return None
        self._errand = errand
        return errand

    def orders(self) -> tuple[ShownOrder, ...]:
        """The commanders' orders to this wearer, of the last HOLDS_S, that hold and are not understood, as of the last call of `news`."""
        (team, name, _), since_s = self._key, time.time() - HOLDS_S
        found = ((kind, self._board.order_to(kind, team, name)) for kind in (EVERYBODY, NOTE))
        return tuple(
            ShownOrder(f"{kind} {one[0].unix_s}", f"{one[0].by}{_ago(one[0].unix_s)}: {one[0].text}", kind == EVERYBODY)
            for kind, one in found if one and not one[1] and one[0].unix_s > since_s
        )  # fmt: skip

    def understand(self, identity: str) -> None:
        """The wearer has understood the order of this identity: the commanders get a receipt; an expired one is ignored."""
        team, name, _ = self._key
        kind = identity.partition(" ")[0]
        found = self._board.order_to(kind, team, name)
        if found is None or f"{kind} {found[0].unix_s}" != identity:
            return
        key, receipt = (kind, team, name), Receipt(1, found[0].unix_s, name[:32], time.time())
        if self._send(*receipt_message(key, receipt)):
            self._board.receipts[key] = receipt

    def _receive(self, message: ReceivedMessage) -> None:
        try:
            self._board.receive(message.topic or "", message.payload)
        except BadReportError as error:
            self.rejected[str(error)] += 1


def _ago(unix_s: float) -> str:
    """The age of an order in whole minutes; empty for a new one."""
    minutes = int((time.time() - unix_s) / 60.0)
    return f", {minutes} min ago" if minutes > 0 else ""
