# SPDX-License-Identifier: MIT
"""The mark feed: marks that commanders have set, the acknowledgements of this run's alarms, and its errand, for the page of a wearer's run.

In: the team subscription. Out: marks on this plan, when they change; names of commanders; an errand, when it is new. Owns the board of
received marks.
"""

from __future__ import annotations

import math
import time
from collections import Counter

from echostep_app.page.elements.marks import ShownMark
from echostep_app.session.team.subscription import LOOK_S, TeamSubscription
from echostep_app.team.endpoint import Outlet
from echostep_app.team.inbox import ReceivedMessage
from echostep_app.team.messages.marks import MARKS, Errand, MarkBoard, acks_of, errand_of
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
        self._looked_s = -math.inf
        self._subscription = subscription
        subscription.add([MARKS, acks_of(outlet.team, outlet.name), errand_of(self._key)], self._receive)

    def news(self) -> tuple[ShownMark, ...] | None:
        """All marks on this plan; None when they are the same as before. Never waits."""
        now_s = time.monotonic()
        if now_s - self._looked_s < LOOK_S:
            return None
        self._looked_s = now_s
        self._subscription.look()
        marks = [m for m in self._board.marks.values() if m.plan_sha256 == self._plan_sha256]
        shown = tuple(ShownMark(m.id, m.mark, m.x_m, m.y_m, m.level, m.by) for m in marks)
        if shown == self._shown:
            return None
        self._shown = shown
        return shown

    def acknowledged_by(self, number: int) -> str | None:
        """The commander that acknowledged the alarm of this number, as of the last call of `news`."""
        team, name, run = self._key
        ack = self._board.acks.get((team, name, f"{run}-{number}"))
        return ack.by if ack else None

    def new_errand(self) -> Errand | None:
        """To whom a commander has sent this wearer on this plan, as of the last call of `news`; each errand is given once."""
        errand = self._board.errands.get(self._key)
        if errand is None or errand == self._errand or errand.plan_sha256 != self._plan_sha256:
            return None
        self._errand = errand
        return errand

    def _receive(self, message: ReceivedMessage) -> None:
        try:
            self._board.receive(message.topic or "", message.payload)
        except BadReportError as error:
            self.rejected[str(error)] += 1
