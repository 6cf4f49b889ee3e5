# SPDX-License-Identifier: MIT
"""`echostep command`: follow a team on one plan, on a page and on the terminal.

In: a plan, a broker's URL. Out: the page, a table on the terminal, a recording, a picture, the roster as JSON. Owns the loop: it empties the
inbox, records what it held, and shows the scene 30 times a second, and draws the table four times.
"""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console, Group
from rich.live import Live

from echostep.plan.model import Plan, load_plan
from echostep_app.operation.operation import Operation
from echostep_app.operation.recorded.record import OperationRecorder
from echostep_app.operation.recorded.replay import replay
from echostep_app.operation.recorded.tape import Keyframe, Tape
from echostep_app.operation.views import Views, finish, open_page
from echostep_app.page.protocol import FRAME_S
from echostep_app.printing.console import console_for_people
from echostep_app.printing.people import FaultNews, outlast_output, output_faults
from echostep_app.team.commander import table
from echostep_app.team.endpoint import Endpoint, parse_endpoint
from echostep_app.team.inbox import Inbox, ListenerThread, ReceivedMessage
from echostep_app.team.messages.marks import ALL, is_shared
from echostep_app.team.messages.report import checked_name
from echostep_app.team.restorer import Restorer

if TYPE_CHECKING:
    from echostep_app.operation.page import TablePage

TABLE_S = 0.25  # between two drawings of the table; assumed


def command(plan_path: Path, url: str, team: str | None, seconds: float | None, views: Views, out: Path) -> None:
    """Show a team until Ctrl-C, or for `seconds`, and record it; then draw the picture and print JSON if asked for. `url`: or a recording."""
    console = console_for_people(stderr=views.as_json)
    if not views.as_json:
        outlast_output()
    if "://" not in url:
        replay(Path(url), load_plan(plan_path), seconds, views, console)
        return
    endpoint = parse_endpoint(url, ("mqtt", "mqtts", "mesh"))
    operation, inbox = Operation(load_plan(plan_path)), Inbox()
    checked = checked_name("--team", team) if team else None
    with ExitStack() as opened:
        recorder = OperationRecorder(out, operation.plan, str(endpoint))
        opened.callback(_end_recording, recorder, console)
        tape = Tape(recorder.path, grows=True)
        page = open_page(opened, operation, "echostep command", views, tape, console)
        console.print(f"Recording: {recorder.path}", highlight=False)
        receiver = _receiver(endpoint, checked, operation.plan, inbox, lambda text: console.print(text, markup=False))
        opened.callback(receiver.close)
        if page and endpoint.scheme != "mesh":  # marks need a broker
            page.feed.send = receiver.send
        restorer = Restorer() if endpoint.scheme != "mesh" else None
        run = _Run(operation, inbox, receiver, recorder, tape, restorer)
        with suppress(KeyboardInterrupt):
            _follow(run, page, console, math.inf if seconds is None else seconds, views)
        run.look(time.monotonic())
        _write_crews(operation, recorder.path, console)
    finish(operation, time.monotonic(), views)
    recorder.check_whole()


def _write_crews(operation: Operation, recording: Path, console: Console) -> None:
    """Write what the crews did beside the recording, where there were any."""
    if operation.crew_log.events:
        path = recording.with_name(f"{recording.stem}-crews.csv")
        operation.crew_log.write(path)
        console.print(f"Crews: {path}", highlight=False, markup=False)


@dataclass(frozen=True, slots=True)
class _Run:
    """An operation with its source and its recording. `restorer` None: the source keeps nothing."""

    operation: Operation
    inbox: Inbox
    receiver: ListenerThread
    recorder: OperationRecorder
    tape: Tape
    restorer: Restorer | None

    def look(self, now_s: float) -> None:
        """Empty the inbox, record its messages, and send the broker those shared messages again that it has lost."""
        unix_s, connected = time.time(), self.receiver.connected
        believed = self.operation.update(self.inbox, now_s, unix_s)
        if self.restorer:
            restore(self.restorer, self.operation, self.receiver, believed, now_s)
        roster = self.operation.roster
        self.recorder.add(believed)
        self.recorder.add_faults(now_s, output_faults())
        self.recorder.add_condition(now_s, unix_s, roster.received, roster.rejected, connected=connected)
        if self.tape.note(now_s, len(believed)):
            self.tape.keep(Keyframe(now_s, unix_s, self.recorder.offset, connected, self.operation.copy()))


def restore(
    restorer: Restorer, operation: Operation, receiver: ListenerThread, believed: list[ReceivedMessage], now_s: float
) -> None:
    """Send marks and acknowledgements again that the broker has lost or replaced; `believed`: messages since the last call."""
    topics = [m.topic for m in believed if m.topic and is_shared(m.topic)]
    lost = restorer.look(receiver.connected, topics, lambda: operation.shared, now_s)
    for topic, payload in lost + operation.take_answers():
        receiver.send(topic, payload)


def _end_recording(recorder: OperationRecorder, console: Console) -> None:
    recorder.close()
    while recorder.notices:
        console.print(recorder.notices.popleft(), markup=False)


def _receiver(
    endpoint: Endpoint, team: str | None, plan: Plan, inbox: Inbox, print_line: Callable[[str], None]
) -> ListenerThread:
    """A subscription to the reports of a team, or of all teams: at a broker, or over a Meshtastic node."""
    if endpoint.scheme == "mesh":
        from echostep_app.team.mesh.mesh import MeshListener

        listener = MeshListener(endpoint, team, plan, inbox.put)
        return ListenerThread(listener, lambda text: print_line(f"{endpoint}: {text}"))
    from echostep_app.team.mqtt.publisher import Listener

    topics = [f"echostep/{team or '+'}/+/+", ALL]
    return ListenerThread(Listener(endpoint, topics, inbox.put), lambda text: print_line(f"{endpoint}: {text}"))


def _follow(run: _Run, page: TablePage | None, console: Console, seconds: float, views: Views) -> None:
    """Show the team for so many seconds; then the whole table, also when it is interrupted."""
    due_s, table_s, operation = time.monotonic(), -math.inf, run.operation
    end_s = due_s + seconds
    pause_s = FRAME_S if page else TABLE_S
    draws, news = console.is_terminal and not views.as_json, FaultNews()

    def drawn(lines: int | None) -> Group:
        connected = run.receiver.connected
        return table(
            operation.roster, operation.plan, time.monotonic(), connected=connected, columns=console.width, lines=lines
        )

    with Live(console=console, auto_refresh=False, transient=False, redirect_stdout=False) as shown:
        try:
            while (now_s := time.monotonic()) < end_s:
                due_s = max(due_s + pause_s, now_s)  # the work is part of the pause
                time.sleep(max(min(due_s, end_s) - now_s, 0.0))
                now_s = time.monotonic()
                run.look(now_s)
                for notices in (run.recorder.notices, page.notices if page else deque[str]()):
                    while notices:
                        console.print(notices.popleft(), markup=False)
                if page:
                    receiver = run.receiver
                    fault = ". ".join(filter(None, (receiver.fault, news.words())))
                    page.publish(operation.scene(now_s, time.time(), connected=receiver.connected, fault=fault))
                if draws and now_s - table_s >= TABLE_S:
                    table_s = now_s
                    shown.update(drawn(console.height), refresh=True)
        finally:
            if draws:
                shown.update(drawn(None))
            elif not views.as_json:  # in a file the end of the live view would leave its last line open
                console.print(drawn(None))
