# SPDX-License-Identifier: MIT
"""Many wearers who walk: reported to a served operation, or to a broker."""

from __future__ import annotations

import math
import os
import threading
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Self

import paho.mqtt.client as paho
from paho.mqtt.enums import CallbackAPIVersion

from echostep_app.page.protocol import FRAME_S
from echostep_app.team.messages.report import Position, encode
from operation.teams import FLOORS, STOREYS, ServedTeam, Team
from players import playing
from team.team_reports import POSITION, report

RATE_HZ = 10.0  # of each wearer
BEFORE_S = 180  # of reports, once a second, before the page is opened: trails do not get longer


def walking(n: int, t_s: float, floor: int) -> Position:
    """Where wearer n is, who walks on a curve at 0.5 to 1 m/s."""
    angle = 0.08 * t_s + n
    x_m, y_m = 15.0 + 12.0 * math.cos(angle), 4.0 + 3.0 * math.sin(1.7 * angle)
    at = replace(POSITION, x_m=x_m, y_m=y_m, floor=floor, floor_name=FLOORS[floor], where="in the corridor")
    return replace(at, heading_rad=math.remainder(angle, math.tau), protection_m=0.4)


class Crowd:
    """A served team whose wearers walk, in a thread of its own. `scenes`: how many were published; `busy_s`: CPU time of that."""

    def __init__(self, wearers: int) -> None:
        self.wearers, self.scenes, self.busy_s = wearers, 0, 0.0
        self._team = team = Team()
        team.gathers = True
        now_s = team.now_s
        for t_s in range(-BEFORE_S, 0):
            team.now_s = now_s + t_s
            self._walk(t_s, range(wearers))
            team.receive()
        self.served = ServedTeam(team)
        self._walks = playing(self._step)
        self._reported = 0

    def __enter__(self) -> Self:
        self.served.__enter__()
        self._began_s = time.monotonic()
        self._walks.__enter__()
        return self

    def __exit__(self, *_: object) -> None:
        self._walks.__exit__(None, None, None)
        self.served.__exit__()

    def _step(self) -> None:
        time.sleep(max(self._began_s + self.scenes * FRAME_S - time.monotonic(), 0.0))
        team, t_s = self._team, time.monotonic() - self._began_s
        team.now_s, team.unix_s = self._began_s + t_s, team.unix_s + FRAME_S
        due = int(t_s * RATE_HZ * self.wearers)
        self._walk(t_s, (n % self.wearers for n in range(self._reported, due)))
        cpu_s, self._reported = time.thread_time(), due
        team.receive()
        self.served.show()
        self.busy_s += time.thread_time() - cpu_s
        self.scenes += 1

    def _walk(self, t_s: float, numbers: Iterable[int]) -> None:
        """Reports of these wearers."""
        for n in numbers:
            self._team.hear(f"wearer {n:03d}", walking(n, t_s, n % STOREYS))


@contextmanager
def publishing(url: str, wearers: int) -> Iterator[None]:
    """Wearers who report ten times a second to a broker, by one connection at QoS 0, until the end."""
    client = paho.Client(CallbackAPIVersion.VERSION2)
    client.connect("127.0.0.1", int(url.rpartition(":")[2]))
    client.loop_start()
    began_s, reported = time.monotonic(), 0

    def step() -> None:
        nonlocal reported
        time.sleep(0.01)
        t_s = time.monotonic() - began_s
        for k in range(reported, due := int(t_s * RATE_HZ * wearers)):
            n, sequence = k % wearers, k // wearers + 1
            made = report(f"wearer {n:03d}", sequence, position=walking(n, t_s, 0))
            client.publish(f"echostep/red/{made.name}/estimate", encode(made))
        reported = due

    with playing(step):
        yield
    client.disconnect()
    client.loop_stop()


class Terminal:
    """What a program writes on a pseudo terminal, read in a thread of its own."""

    def __init__(self, descriptor: int) -> None:
        self.text = b""
        self._descriptor = descriptor
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        with suppress(OSError):
            while part := os.read(self._descriptor, 65_536):
                self.text = (self.text + part)[:4096]


def child_cpu_s(pid: int) -> float:
    """Seconds of CPU that a running process has used [proc(5)]."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
