# SPDX-License-Identifier: MIT
"""Orders of the commanders to wearers: everybody out, and a note in words to one wearer; each wearer's page says that it was understood. And notes to
the commanders' log.

In: retained messages from untrusted senders, on `echostep-table/order/everybody`, `echostep-table/order/<team>/<wearer>`,
`echostep-table/receipt/<everybody|note>/<team>/<wearer>` and `echostep-table/log/<id>`. Out: `Order`s and `Receipt`s, and the messages for new
ones. Owns nothing. Of several orders to the same ones, and of several receipts of one wearer, the latest counts (`shared.Kept`), so there are no
more than wearers.
"""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from echostep_app.team.messages.shared import Person, UnixTime

ORDERS, RECEIPTS, LOG = "echostep-table/order", "echostep-table/receipt", "echostep-table/log"
EVERYBODY, NOTE = "everybody", "note"  # kinds of orders
OUT = "Everybody out!"
MOST_ORDERS, MOST_RECEIPTS, MOST_NOTES = 257, 512, 512  # of as many wearers as a roster has; further ones are refused
# An order to a wearer holds, a note is shown so long: a broker keeps it, and the next day it would be another operation's; assumed
HOLDS_S = 12 * 3600.0
NoteText = Annotated[str, Meta(min_length=1, max_length=200)]
ReceiptKey = tuple[str, str, str]  # "everybody" or "note", team, wearer


class Order(msgspec.Struct, frozen=True):
    """An order that the commander `by` wrote at `unix_s`. `ended`: it holds no longer."""

    echostep_order: Literal[1]
    text: NoteText
    by: Person
    unix_s: UnixTime
    ended: bool = False


class Receipt(msgspec.Struct, frozen=True):
    """The wearer `by` has understood the order of the time `order_s`."""

    echostep_receipt: Literal[1]
    order_s: UnixTime
    by: Person
    unix_s: UnixTime


def order_message(key: str, order: Order) -> tuple[str, bytes]:
    """Topic and payload of an order to `key`: everybody, or <team>/<wearer>."""
    return f"{ORDERS}/{key}", msgspec.json.encode(order)


def note_message(identity: str, note: Order) -> tuple[str, bytes]:
    """Topic and payload of a note to the log."""
    return f"{LOG}/{identity}", msgspec.json.encode(note)


def receipt_message(key: ReceiptKey, receipt: Receipt) -> tuple[str, bytes]:
    """Topic and payload of a wearer's answer."""
    return f"{RECEIPTS}/{'/'.join(key)}", msgspec.json.encode(receipt)
