# SPDX-License-Identifier: MIT
"""The board's reports about itself.

In: the board's messages. Out: `BoardReports`. Owns the newest reports and the previous status.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from echostep.board import messages
from echostep.board.messages import Reports

OPTIONAL = Reports.BOARD_HEALTH | Reports.PARTS | Reports.MOTION | Reports.MAGNETIC | Reports.FOOT
SUBSCRIBE = messages.Subscribe(OPTIONAL)  # what a run asks a board for
_NEWEST: dict[type[messages.Message], str] = {  # of which the newest one is kept
    messages.Identity: "identity", messages.Configuration: "configuration", messages.BoardHealth: "board_health",
    messages.Parts: "parts", messages.Electrical: "electrical", messages.Loop: "loop",
}  # fmt: skip


@dataclass(slots=True)
class BoardReports:
    """The board's newest reports about itself, and the previous status: a counter that has increased since then is a new problem."""

    identity: messages.Identity | None = None
    configuration: messages.Configuration | None = None
    status: messages.Status | None = None
    previous_status: messages.Status | None = None
    board_health: messages.BoardHealth | None = None
    usual_supply_mv: int = 0  # highest voltage so far
    gyros: dict[int, messages.GyroHealth] = field(default_factory=dict)
    parts: messages.Parts | None = None
    foot: messages.FootHealth | None = None  # of a foot board
    previous_foot: messages.FootHealth | None = None
    electrical: messages.Electrical | None = None
    loop: messages.Loop | None = None

    def add(self, message: messages.Message) -> None:
        """Keep a message if it is a report; after a restart of the board there is no previous status."""
        if name := _NEWEST.get(type(message)):
            setattr(self, name, message)
        if isinstance(message, messages.BoardHealth):
            self.usual_supply_mv = max(self.usual_supply_mv, message.supply_mv)
        elif isinstance(message, messages.FootHealth):
            self.previous_foot, self.foot = self.foot, message
        elif isinstance(message, messages.GyroHealth):
            self.gyros[message.gyro] = message
        elif isinstance(message, messages.Status):
            restarted = self.status is not None and message.ticks < self.status.ticks  # or the ticks have wrapped
            self.previous_status, self.status = None if restarted else self.status, message

    @property
    def dropped(self) -> int:
        """Samples and messages that the board has dropped, by its newest status."""
        counts = {} if self.status is None else self.status._asdict()
        return sum(count for name, count in counts.items() if name.startswith("dropped_"))

    @property
    def sensors(self) -> messages.Sensors:
        """The sensors that are switched on; all of them before the first `Configuration`, none on a foot board."""
        if self.foot is not None:
            return messages.Sensors(0)
        return messages.Sensors(0xFF if self.configuration is None else self.configuration.sensors)
