# SPDX-License-Identifier: MIT
"""The board's reports about itself.

In: the board's messages. Out: `BoardReports`. Owns the newest reports and the previous status.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from echostep.board.messages import (
    BoardHealth,
    Configuration,
    Electrical,
    FootHealth,
    GyroHealth,
    Identity,
    Loop,
    Message,
    Parts,
    Sensors,
    Status,
)


@dataclass(slots=True)
class BoardReports:
    """The board's newest reports about itself, and the previous status: a counter that has increased since then is a new problem."""

    identity: Identity | None = None
    configuration: Configuration | None = None
    status: Status | None = None
    previous_status: Status | None = None
    board_health: BoardHealth | None = None
    usual_supply_mv: int = 0  # highest voltage so far
    gyros: dict[int, GyroHealth] = field(default_factory=dict)
    parts: Parts | None = None
    foot: FootHealth | None = None  # of a foot board
    previous_foot: FootHealth | None = None
    electrical: Electrical | None = None
    loop: Loop | None = None

    def add(self, message: Message) -> None:
        """Keep a message if it is a report; after a restart of the board there is no previous status."""
        if isinstance(message, Identity):
            self.identity = message
        elif isinstance(message, Configuration):
            self.configuration = message
        elif isinstance(message, BoardHealth):
            self.board_health = message
            self.usual_supply_mv = max(self.usual_supply_mv, message.supply_mv)
        elif isinstance(message, Parts):
            self.parts = message
        elif isinstance(message, FootHealth):
            self.previous_foot, self.foot = self.foot, message
        elif isinstance(message, Electrical):
            self.electrical = message
        elif isinstance(message, Loop):
            self.loop = message
        elif isinstance(message, GyroHealth):
            self.gyros[message.gyro] = message
        elif isinstance(message, Status):
            restarted = self.status is not None and message.ticks < self.status.ticks  # or the ticks have wrapped
            self.previous_status, self.status = None if restarted else self.status, message

    @property
    def sensors(self) -> Sensors:
        """The sensors that are switched on; all of them before the first `Configuration`, none on a foot board."""
        if self.foot is not None:
            return Sensors(0)
        return Sensors(0xFF if self.configuration is None else self.configuration.sensors)
