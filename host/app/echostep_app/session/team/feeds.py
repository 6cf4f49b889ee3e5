# SPDX-License-Identifier: MIT
"""A run's other input from the team: the commanders' marks, acknowledgements, errands, orders.

In: the team subscription. Out: marks on this plan, when they change; names of commanders; an errand, when it is new. Owns the board of received
marks.
"""

from __future__ import annotations

import time
from collections import Counter

from echostep_app.page.elements.marks import ShownMark, ShownOrder
from echostep_app.session.team.subscription import TeamSubscription
from echostep_app.team.endpoint import Outlet
from echostep_app.team.inbox import ReceivedMessage
from echostep_app.team.messages.marks import MARKS, Errand, MarkBoard, acks_of, errand_of
from echostep_app.team.messages.orders import EVERYBODY, HOLDS_S, NOTE, ORDERS, RECEIPTS, Receipt, receipt_message
from echostep_app.team.messages.report import BadReportError


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
        """Where the mayday of this number has arrived, as of the last call of `news`: a person, a commander's computer; empty: nowhere yet."""
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
