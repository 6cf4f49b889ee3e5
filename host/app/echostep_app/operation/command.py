# SPDX-License-Identifier: MIT
"""`echostep command`: follow a team on one plan, on a page and on the terminal.

In: a plan, a broker's URL. Out: the page, a table on the terminal, a recording, the roster as JSON. Owns the loop: it empties the
inbox, records the messages, and shows the scene 30 times a second, and draws the table four times.
After a new connection, the restorer sends what the commanders share again where the broker has lost it.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.live import Live

from echostep.plan import load_plan
from echostep_app.operation.operation import Operation, TableScene
from echostep_app.operation.recorded.record import OperationRecorder
from echostep_app.operation.recorded.replay import Views, replay
from echostep_app.operation.terminal import listed
from echostep_app.page.protocol import FRAME_S
from echostep_app.printing.console import console_for_people, print_notices
from echostep_app.printing.people import FaultNews, outlast_output, output_faults
from echostep_app.team.endpoint import BROKERS, Endpoint, parse_endpoint
from echostep_app.team.inbox import Inbox, ListenerThread
from echostep_app.team.messages.marks import ALL
from echostep_app.team.messages.report import checked_name

if TYPE_CHECKING:
    from echostep_app.operation.page import TablePage
from collections import deque
from collections.abc import Iterable

from echostep_app.team.inbox import ReceivedMessage
from echostep_app.team.messages.marks import is_shared

RETAINED_S = 2.0  # within which a broker has sent all that it keeps: it does so before anything else
AT_ONCE = 16  # messages at one look: fewer than a connection lets wait (`inbox.MOST_OUTGOING`)
Message = tuple[str, bytes]  # topic and payload


class Restorer:
    """`look` gives the messages that are to be sent now."""

    def __init__(self) -> None:
        self._connected = False
        self._due_s = math.inf
        self._received: set[str] = set()
        self._missing: deque[Message] = deque()

    def look(
        self, connected: bool, received: Iterable[str], known: Callable[[], Iterable[Message]], now_s: float
    ) -> list[Message]:
        """Messages of `known` whose topic the broker has not sent since the connection; `received`: topics since the last call."""
        if connected != self._connected:
            self._connected, self._due_s = connected, now_s + RETAINED_S if connected else math.inf
            self._received.clear()
            self._missing.clear()
        if not connected:
            return []
        if self._due_s < math.inf:
            self._received.update(received)
        if now_s >= self._due_s:
            self._due_s = math.inf
            self._missing.extend(message for message in known() if message[0] not in self._received)
            self._received.clear()
        return [self._missing.popleft() for _ in range(min(AT_ONCE, len(self._missing)))]


def restore(
    restorer: Restorer, operation: Operation, receiver: ListenerThread, believed: list[ReceivedMessage], now_s: float
) -> None:
    """Send marks and acknowledgements again that the broker has lost or replaced; `believed`: messages since the last call."""
    topics = [m.topic for m in believed if m.topic and is_shared(m.topic)]
    lost = restorer.look(receiver.connected, topics, lambda: operation.shared, now_s)
    for topic, payload in lost + operation.take_answers():
        receiver.send(topic, payload)


TABLE_S = 0.25  # between two drawings of the table; assumed


def command(plan_path: Path, url: str, team: str | None, seconds: float | None, views: Views, out: Path) -> None:
    """Show a team until Ctrl-C, or for `seconds`, and record it; then print JSON if asked for. `url`: or a recording."""
    console = console_for_people(stderr=views.as_json)
    if not views.as_json:
        outlast_output()
    if "://" not in url:
        replay(Path(url), load_plan(plan_path), seconds, views, console)
        return
    endpoint = parse_endpoint(url, BROKERS)
    operation, inbox = Operation(load_plan(plan_path), all_teams=team is None), Inbox()
    checked = checked_name("--team", team) if team else None
    with ExitStack() as opened:
        recorder = OperationRecorder(out, operation, str(endpoint))
        recording = recorder.file
        opened.callback(print_notices, recording.notices, console)
        opened.callback(recording.close)
        page = views.open_page(opened, operation, "echostep command", console)
        console.print(f"Recording: {recording.path}", highlight=False)
        receiver = _receiver(endpoint, checked, inbox, lambda text: console.print(text, markup=False))
        opened.callback(receiver.close)
        if page:
            page.feed.send = receiver.send
        run = _Run(operation, inbox, receiver, recorder, Restorer())
        with suppress(KeyboardInterrupt):
            _follow(run, page, console, math.inf if seconds is None else seconds, views)
        run.look(time.monotonic())
        if operation.crew_log.events:
            path = recording.path.with_name(f"{recording.path.stem}-crews.csv")
            operation.crew_log.write(path)
            console.print(f"Crews: {path}", highlight=False, markup=False)
    views.finish(operation, time.monotonic())
    recording.check_whole()


@dataclass(frozen=True, slots=True)
class _Run:
    """An operation with its source and its recording."""

    operation: Operation
    inbox: Inbox
    receiver: ListenerThread
    recorder: OperationRecorder
    restorer: Restorer

    def look(self, now_s: float) -> None:
        """Empty the inbox, record its messages, and send the broker those shared messages again that it has lost."""
        unix_s, connected = time.time(), self.receiver.connected
        believed = self.operation.receive(*self.inbox.take_all(), now_s, unix_s)
        restore(self.restorer, self.operation, self.receiver, believed, now_s)
        self.recorder.add(believed, now_s, unix_s, connected=connected, faults=output_faults())


def _receiver(endpoint: Endpoint, team: str | None, inbox: Inbox, print_line: Callable[[str], None]) -> ListenerThread:
    """A subscription to the reports of a team, or of all teams, at a broker."""
    from echostep_app.team.mqtt.publisher import Listener

    listener = Listener(endpoint, [f"echostep/{team or '+'}/+/+", ALL], inbox.put)
    return ListenerThread(listener, lambda text: print_line(f"{endpoint}: {text}"))


def _follow(run: _Run, page: TablePage | None, console: Console, seconds: float, views: Views) -> None:
    """Show the team for so many seconds; then the whole table, also when it is interrupted."""
    due_s, table_s, operation = time.monotonic(), -math.inf, run.operation
    end_s = due_s + seconds
    pause_s = FRAME_S if page else TABLE_S
    draws, news = console.is_terminal and not views.as_json, FaultNews()

    def scene() -> TableScene:
        receiver = run.receiver
        fault = ". ".join(filter(None, (receiver.fault, news.words())))
        connected, waiting = receiver.connected, receiver.waiting
        return operation.scene(time.monotonic(), time.time(), connected=connected, fault=fault, waiting=waiting)

    with Live(console=console, auto_refresh=False, transient=False, redirect_stdout=False) as shown:
        try:
            while (now_s := time.monotonic()) < end_s:
                due_s = max(due_s + pause_s, now_s)  # the work is part of the pause
                time.sleep(max(min(due_s, end_s) - now_s, 0.0))
                now_s = time.monotonic()
                run.look(now_s)
                print_notices(run.recorder.file.notices, console)
                if page:
                    page.feed.exchange.note_alive()
                    print_notices(page.notices, console)
                    page.feed.publish(scene())
                if draws and now_s - table_s >= TABLE_S:
                    table_s = now_s
                    shown.update(listed(scene(), operation.plan.name), refresh=True)
        finally:
            if draws:
                shown.update(listed(scene(), operation.plan.name))
            elif not views.as_json:  # in a file the end of the live view would leave its last line open
                console.print(listed(scene(), operation.plan.name))
