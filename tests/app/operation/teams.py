# SPDX-License-Identifier: MIT
"""A team of simulated wearers in a tower of three storeys, as a commander's inbox receives it, and its page."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, Self

from echostep.plan import Plan
from echostep_app.operation.operation import Operation, TableScene
from echostep_app.operation.page import TablePage
from echostep_app.operation.recorded.record import OperationRecorder
from echostep_app.operation.recorded.tape import MOST_STEPS, STEP_S
from echostep_app.operation.requests import Action
from echostep_app.operation.words import ShownEvent
from echostep_app.page.server import Address
from echostep_app.plan.places.whereabouts import Whereabouts
from echostep_app.printing.lines import moment
from echostep_app.team.inbox import Inbox, ReceivedMessage
from echostep_app.team.messages.marks import Mark, MarkKind
from echostep_app.team.messages.report import Position, Report, ReportedAlarm, encode
from echostep_simulation.world.tower import tower
from team.team_reports import POSITION, report

STOREYS = 3
FLOORS = ("Ground floor", "1st floor", "2nd floor")
_PLAIN = tower(STOREYS)
TOWER = replace(
    _PLAIN,
    digest="7" * 64,
    name="Tower",
    levels=tuple(replace(level, name=name) for level, name in zip(_PLAIN.levels, FLOORS, strict=True)),
)
WORDS = Whereabouts(TOWER)
BASE = report()
NAMES = ("Kim", "Anna", "Bo", "Chris", "Dana", "Eve", "Finn", "Gil")


def place(plan: Plan, x_m: float, y_m: float, floor: int, **fields: Any) -> Position:
    """A position on a plan, with its words."""
    words = WORDS.words(x_m, y_m, floor) if plan is TOWER else ""
    at = replace(POSITION, x_m=x_m, y_m=y_m, floor=floor, floor_name=plan.levels[floor].name, where=words)
    return replace(at, **({"protection_m": 0.4} | fields))


class Team:
    """Wearers whose reports go into one operation. `now_s`: the commander's clock."""

    def __init__(self, plan: Plan = TOWER, now_s: float | None = None) -> None:
        self.plan = plan
        self.operation = Operation(plan)
        self.now_s = time.monotonic() if now_s is None else now_s
        self.unix_s = 1.8e9
        self.gathers = False  # messages wait for `receive`
        self.on_believed: Callable[[list[ReceivedMessage]], None] = lambda _: None
        self._inbox = Inbox()
        self._sequence: dict[str, int] = {}

    def hear(self, name: str, position: Position | None, **fields: Any) -> None:
        """A report of this wearer, of now."""
        self._sequence[name] = self._sequence.get(name, 0) + 1
        status: dict[str, Any] = {"status": "waiting", "place": None} if position is None else {}
        known: dict[str, Any] = {"plan_sha256": self.plan.digest, "position": position} | status
        sent: dict[str, Any] = {
            "time": moment(self.unix_s),
            "stale": moment(self.unix_s + 10.0),
            "sequence": self._sequence[name],
        }
        self.put(replace(BASE, name=name, **(sent | known | fields)))

    def put(self, made: Report) -> None:
        """A report as it is."""
        self.put_bytes(f"echostep/{made.team}/{made.name}/estimate", encode(made))

    def put_bytes(self, topic: str, payload: bytes) -> None:
        """Any message."""
        self._inbox.put(topic, payload, False)
        if not self.gathers:
            self.receive()

    def ask(self, request: Action) -> str:
        """What a page asks for, through the broker and back; the reason of a refusal."""
        message = self.operation.act(request, self.unix_s, self.now_s)
        if isinstance(message, str):
            return message
        self.put_bytes(*message)
        return ""

    def details(self, number: int) -> tuple[dict[str, str], tuple[ShownEvent, ...]]:
        """A wearer's facts by name, and the history."""
        details = self.operation.details(number, self.now_s)
        assert details
        return {fact.name: fact.value for fact in details.facts}, details.history

    def receive(self) -> None:
        """Have the operation take what came."""
        messages, dropped = self._inbox.take_all()
        dated = [message._replace(received_s=self.now_s, unix_s=self.unix_s) for message in messages]
        self.on_believed(self.operation.receive(dated, dropped, self.now_s, self.unix_s))

    def pass_time(self, seconds: float) -> None:
        """Nothing is heard for so many seconds; the operation looks as often as its player."""
        steps = min(math.ceil(seconds / STEP_S), MOST_STEPS)
        began_s, began_unix_s = self.now_s, self.unix_s
        for k in range(1, steps + 1):
            self.now_s, self.unix_s = began_s + seconds * k / steps, began_unix_s + seconds * k / steps
            self.on_believed(self.operation.receive([], {}, self.now_s, self.unix_s))

    def scene(self, **how: Any) -> TableScene:
        """What a page would be sent."""
        return self.operation.scene(self.now_s, self.unix_s, **how)


class Recording:
    """A team whose operation is recorded."""

    def __init__(self, folder: Path, team: Team) -> None:
        recorder = OperationRecorder(folder / "operation.mcap", team.operation, "mqtt://broker:1883")
        self.file = recorder.file
        team.on_believed = lambda believed: recorder.add(believed, team.now_s, team.unix_s, connected=True)

    def on_disk(self) -> bool:
        """Whether the operating system has all of it."""
        return self.file.path.stat().st_size == self.file.offset

    def close(self) -> Path:
        self.file.close()
        return self.file.path


def whole_team(team: Team | None = None) -> Team:
    """Eight wearers: tracked on three storeys, one fallen, one lost, one silent, one uncertain, one without a position."""
    team = team or Team()
    x_m, y_m = TOWER.levels[0].rooms[0].at_m
    fallen = place(TOWER, x_m, y_m, 0)
    kinds: tuple[MarkKind, ...] = ("cleared", "hazard", "meeting")
    for k, kind in enumerate(kinds):
        spot_m = (x_m - 10.0 + 9.0 * k, y_m + 4.5 - 4.5 * (k == 2))
        team.put_bytes(*Mark(1, f"{k:08x}", kind, *spot_m, 0, "Ann", team.unix_s, TOWER.digest).message)
    for k in range(12):
        for n, name in enumerate(NAMES):
            angle = 0.15 * k + n
            at = place(
                TOWER,
                x_m + 3.0 * math.cos(angle),
                y_m + 1.2 * math.sin(angle),
                n % STOREYS,
                heading_rad=math.remainder(angle, math.tau),
            )
            fallen = at if name == "Finn" and k < 6 else fallen
            if name == "Chris":
                team.hear(name, None)
            elif name == "Kim" and k > 6:
                lost = replace(at, radius95_m=8.0, xx_m2=11.0, xy_m2=0.0, yy_m2=11.0, protection_m=None)
                team.hear(name, lost, status="lost")
            elif name == "Finn" and k > 5:
                alarm = ReportedAlarm("mayday", "no motion", 1, 30.0 + 1.5 * (k - 5))
                team.hear(name, fallen, alarm=alarm)
            elif name == "Dana":
                team.hear(name, replace(at, radius95_m=2.0, protection_m=3.0), status="uncertain")
            elif name != "Bo" or k < 4:
                team.hear(name, at, battery_percent=12 if name == "Eve" else 80)
        team.pass_time(1.5)
    return team


class ServedTeam:
    """The page of a team; `show` publishes its present scene."""

    def __init__(self, team: Team) -> None:
        self.team = team
        self.page = TablePage(team.operation, "Simulated operation", Address(port=0))

    def show(self, **how: Any) -> None:
        self.page.feed.publish(self.team.scene(**how))

    def __enter__(self) -> Self:
        self.page.__enter__()
        self.show()
        return self

    def __exit__(self, *_: object) -> None:
        self.page.__exit__(None, None, None)
