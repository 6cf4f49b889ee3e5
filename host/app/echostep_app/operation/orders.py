# SPDX-License-Identifier: MIT
"""Orders to the wearers as a commander's page shows them: everybody out, and notes; who has understood.

In: the board, the members. Out: messages, remarks of the list, entries of the histories, `ShownOrder`: plain data. Owns nothing.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from msgspec import structs

from echostep_app.operation import requests
from echostep_app.team.messages.marks import MarkBoard
from echostep_app.team.messages.orders import EVERYBODY, NOTE, Order, order_message
from echostep_app.team.roster import Member, MemberState

NEWER_S = 1e-3  # by which an order or errand is newer than the one that it replaces, however this clock was set back


@dataclass(frozen=True, slots=True)
class ShownOrder:
    """The order to everybody. `understood` of `of` wearers confirmed it; `missing`: names of the others. The names are keys of the page's JSON."""

    text: str
    by: str
    unix_s: float
    understood: int
    of: int
    missing: tuple[str, ...]


def order_by(request: requests.SetOrder, m: Member | None, board: MarkBoard, unix_s: float) -> tuple[str, bytes]:
    """The message of a commander's request: to a member, or to everybody."""
    key = f"{m.report.team}/{m.report.name}" if m else EVERYBODY
    known = board.orders.get(key)
    newer_s = known.unix_s + NEWER_S if known else 0.0
    return order_message(key, Order(1, request.text, request.by, max(unix_s, newer_s), request.ended))


def shown_order(board: MarkBoard, members: Iterable[Member], now_s: float) -> ShownOrder | None:
    """The order to everybody while it holds; of those whose run has ended nothing is expected."""
    order = board.orders.get(EVERYBODY)
    if order is None or order.ended:
        return None
    asked = [m for m in members if m.state(now_s) is not MemberState.ENDED]
    found = [(m.report.name, board.order_to(EVERYBODY, m.report.team, m.report.name)) for m in asked]
    missing = tuple(name for name, one in found if one and not one[1])
    return ShownOrder(order.text, order.by, order.unix_s, len(asked) - len(missing), len(asked), missing)


def order_over(board: MarkBoard, members: Iterable[Member], now_s: float, unix_s: float) -> tuple[str, bytes] | None:
    """The message that ends the order to everybody once all runs have ended, one of them after it; None before. All commanders make the same one."""
    order = board.orders.get(EVERYBODY)
    if order is None or order.ended:
        return None
    states = [(m.state(now_s), unix_s - m.silent_s(now_s)) for m in members]
    if not any(heard_s > order.unix_s for _, heard_s in states) or {s for s, _ in states} != {MemberState.ENDED}:
        return None
    board.orders[EVERYBODY] = over = structs.replace(order, ended=True, unix_s=order.unix_s + NEWER_S)
    return order_message(EVERYBODY, over)


def order_notes(board: MarkBoard, m: Member) -> list[str]:
    """Remarks on a member: which orders it has understood, and which not."""
    found = [(kind, board.order_to(kind, m.report.team, m.report.name)) for kind in (EVERYBODY, NOTE)]
    return [
        f"{'understood' if has_understood else 'not understood yet'}: {order.text}"
        for _, one in found if one for order, has_understood in (one,)
    ]  # fmt: skip


def order_news(before: MarkBoard, board: MarkBoard, m: Member) -> list[str]:
    """The changes by a message for a member, in words for its history."""
    news = []
    for kind in (EVERYBODY, NOTE):
        old, new = (one.order_to(kind, m.report.team, m.report.name) for one in (before, board))
        if old == new:
            continue
        if new is None:
            news += ["everybody out: ended"] if kind == EVERYBODY else []
        elif old is None or old[0] != new[0]:
            news.append(f"{new[0].by}: {new[0].text}")
        elif new[1]:
            news.append(f"understood: {new[0].text}")
    return news
