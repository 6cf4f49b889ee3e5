# SPDX-License-Identifier: MIT
"""Which boards are asked for their optional messages, and when.

In: the board's messages in order. Out: whether to send `SUBSCRIBE` now. Owns the state of the request. A board that has restarted, or whose
port was reopened, must be asked again; a board with older firmware would count the request as damaged.
"""

from __future__ import annotations

from echostep.board.messages import BoardHealth, Identity, Message

FIRST_VERSION = (1, 2)  # of the firmware that knows `Subscribe`


def knows_subscriptions(identity: Identity) -> bool:
    """Whether a board with this firmware sends optional messages."""
    return (identity.version_major, identity.version_minor) >= FIRST_VERSION


class BoardSubscription:
    """Call `is_due` with every message of the board. A subscribed board sends both `Identity` and `BoardHealth` once a second."""

    def __init__(self) -> None:
        self._answered = False  # since the last `Identity`

    def is_due(self, message: Message) -> bool:
        """Whether to send `SUBSCRIBE` after this message."""
        if isinstance(message, BoardHealth):
            self._answered = True
        if not isinstance(message, Identity):
            return False
        was_answered, self._answered = self._answered, False
        return not was_answered and knows_subscriptions(message)
