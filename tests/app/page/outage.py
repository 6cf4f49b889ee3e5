# SPDX-License-Identifier: MIT
"""What feeds a page, in a process of its own that can be stopped, behind a wire that can be frozen or cut.

`python -m page.outage wearer` serves a wearer's page, `commander` a commander's; each prints its address, and then a line for each request
that it has carried out.
"""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from itertools import count
from typing import Self

from echostep_app.page.elements.guidance import ShownGuidance
from echostep_app.page.mailbox import Mailbox, popped
from echostep_app.page.web import access
from echostep_app.plan.routing import Goal
from operation.teams import ServedTeam, Team, whole_team
from page.frames import PLAN, scene, served
from waiting import PATIENCE_S

PAUSE_S = 0.2
WAY = ShownGuidance("walk", "Straight on", 0.0, 12.0, ((2.0, 7.5), (14.0, 7.5)), "Straight on.", 1.0)


def serve_wearer() -> None:
    """A wearer who stands still, guided to a room."""
    access.has_other_users = lambda: False  # else there would be a token in the address
    with served(Mailbox(PLAN, "echostep live", replay=False)) as (server, mailbox):
        print(server.url, flush=True)
        goal: Goal | None = None
        for k in count():
            mailbox.publish(replace(scene(1.0 + PAUSE_S * k), status_text="tracking, 0.2 m", guidance=WAY))
            mailbox.exchange.note_alive()
            for request in popped(mailbox.check_ins):
                print(request, flush=True)
            if mailbox.goal is not goal:
                goal = mailbox.goal
                print(goal, flush=True)
            time.sleep(PAUSE_S)


def serve_commander() -> None:
    """Eight wearers, one of them fallen, of whom nothing new is heard."""
    access.has_other_users = lambda: False
    team = whole_team(Team(now_s=0.0))
    with ServedTeam(team) as table:

        def send(topic: str, payload: bytes) -> bool:
            print(topic, flush=True)
            team.put_bytes(topic, payload)
            return True

        table.page.feed.send = send
        print(table.page.url, flush=True)
        while True:
            table.show()
            table.page.feed.exchange.note_alive()
            time.sleep(PAUSE_S)


class Feeder:
    """The process; `lines`: what it has carried out."""

    def __init__(self, role: str) -> None:
        environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
        command = [sys.executable, "-m", "page.outage", role]
        self._process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment)
        assert self._process.stdout
        self.url = self._process.stdout.readline().strip()
        self.lines: list[str] = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        assert self._process.stdout
        for line in self._process.stdout:
            self.lines.append(line.strip())

    def stop(self) -> None:
        """It hangs: its sockets stay open."""
        self._process.send_signal(signal.SIGSTOP)

    def go_on(self) -> None:
        self._process.send_signal(signal.SIGCONT)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._process.wait(PATIENCE_S)
        self._reader.join(PATIENCE_S)
        assert self._process.stdout
        self._process.stdout.close()


class Wire:
    """Between a page and its server. `freeze`: nothing passes and nobody is told, as out of a Wi-Fi's reach; `cut`: all is closed and refused."""

    def __init__(self, url: str) -> None:
        self.lead_to(url)
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.url = f"http://127.0.0.1:{self._listener.getsockname()[1]}/"
        self._passes = threading.Event()
        self._passes.set()
        self._is_cut = False
        self._ends: set[socket.socket] = set()
        threading.Thread(target=self._accept, daemon=True).start()

    def lead_to(self, url: str) -> None:
        """The end of the wire from now on."""
        self._to = ("127.0.0.1", int(url.rstrip("/").rpartition(":")[2]))

    def freeze(self) -> None:
        self._passes.clear()

    def cut(self) -> None:
        self._is_cut = True
        for end in list(self._ends):
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)

    def mend(self) -> None:
        self._is_cut = False
        self._passes.set()

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                near, _ = self._listener.accept()
                if self._is_cut:
                    near.close()
                    continue
                far = socket.create_connection(self._to)
                self._ends |= {near, far}
                for a, b in ((near, far), (far, near)):
                    threading.Thread(target=self._carry, args=(a, b), daemon=True).start()

    def _carry(self, a: socket.socket, b: socket.socket) -> None:
        with contextlib.suppress(OSError):
            while data := a.recv(65536):
                self._passes.wait()
                b.sendall(data)
        for end in (a, b):
            self._ends.discard(end)
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)
            end.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._listener.close()
        self.mend()
        self.cut()


@contextlib.contextmanager
def outage(kind: str, feeder: Feeder, wire: Wire) -> Iterator[None]:
    """For a while the process stands still, or the wire passes nothing, as of a computer that sleeps, or it is cut."""
    begin, end = {
        "stopped": (feeder.stop, feeder.go_on),
        "frozen": (wire.freeze, wire.mend),
        "asleep": (wire.freeze, wire.mend),
        "cut": (wire.cut, wire.mend),
    }[kind]
    begin()
    yield
    end()


if __name__ == "__main__":
    {"wearer": serve_wearer, "commander": serve_commander}[sys.argv[1]]()
