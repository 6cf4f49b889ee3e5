# SPDX-License-Identifier: MIT
"""An operation: a team on one broker with a commander; one wearer is lost, one has fallen, and a rescuer is guided to the fallen one.

In: number of wearers, speed; the twin for those with the real firmware. Out: the commander's page at a fixed address, its recording and table of
crews, figures on the terminal. Owns the broker and all processes. The fallen wearer and the rescuer are simulated walks through the whole tracker,
each in a process of its own, the others simulated reports; the rescuer starts after the mayday. Exit status 1 when one of these events is missing.
"""

from __future__ import annotations

import json
import os
import resource
import shlex
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

from echostep.plan.model import Plan, load_plan
from echostep.ports.chunks import Chunk
from echostep.tracker import Tracker
from echostep_app.guidance.cues import CueKind
from echostep_app.interruption import wait_for
from echostep_app.session.chunk_streams import paced, portions_of, with_messages
from echostep_app.session.options import OutputOptions
from echostep_app.session.session import Session
from echostep_app.simulation.devices.board import PythonBoard
from echostep_app.simulation.people.walker import Waypoint
from echostep_app.simulation.scenario import Scenario
from echostep_app.team.commander import update_roster
from echostep_app.team.endpoint import parse_endpoint, parse_outlet
from echostep_app.team.inbox import Inbox, ListenerThread
from echostep_app.team.mqtt.publisher import Listener, MqttTransport
from echostep_app.team.outbox import Outbox
from echostep_app.team.publish import empty_report
from echostep_app.team.roster import Member, MemberState, Roster
from places import PLAN, TWIN
from reliability.broker import broker
from reliability.campaign import options
from reliability.operation_crews import INSIDE, RESCUE, SimulatedCrews, crews_written
from reliability.processes import start_python
from reliability.team_load import report_at

FALLEN_WAY: tuple[Waypoint, ...] = (
    (2.0, 7.5),
    (9.5, 7.5),
    (9.5, 10.8, 300.0),
)  # into a room, where nothing moves any more
RESCUE_WAY: tuple[Waypoint, ...] = ((24.0, 2.0), (24.0, 7.5), (9.5, 7.5), (9.5, 10.8))
RATE_HZ = 10.0  # of the simulated reports
LONGEST_S = 300.0  # of the whole operation
PORT = 8420  # of the commander's page, as that of any page


def walk(role: str, url: str, plan: Plan, speed: float) -> None:
    """One wearer: the whole tracker on a simulated walk, published; the rescuer is guided to `fallen`. Prints the last cue as JSON."""
    way, seed = (RESCUE_WAY, 8) if role == "rescuer" else (FALLEN_WAY, 7)
    scenario = Scenario(plan, way, seed, PythonBoard(seed=seed))
    tracker = Tracker(plan, scenario.start, seed=seed)
    with tempfile.TemporaryDirectory() as folder:
        output = OutputOptions(Path(folder), terminal=False, outlet=parse_outlet([url], role, "load"))
        guide = "wearer:fallen" if role == "rescuer" else None
        with Session(tracker, role, "simulated", output, guide) as session:
            session.prepare()
            print("walks", flush=True)
            chunks = with_messages(paced(scenario.chunks(), speed), session.message_sources, _arrival_ns)
            session.track(portions_of(chunks, 16))
            cue = session.guided.cue if session.guided else None
    print(json.dumps({"role": role, "cue": cue.text if cue else "", "kind": cue.kind.value if cue else ""}), flush=True)


def _arrival_ns(chunk: Chunk | None) -> int:
    return chunk.t_arrival_ns if chunk else 0


class Crowd:
    """Wearers whose reports are simulated; the first one is lost."""

    def __init__(self, url: str, plan: Plan, count: int) -> None:
        names = ["lost", *(f"wearer {k:02d}" for k in range(1, count))]
        self._bases = [empty_report(plan, name, "load", f"{k:08x}", "simulated") for k, name in enumerate(names)]
        endpoint = parse_endpoint(url)
        self._boxes = [Outbox(MqttTransport(endpoint, b.team, b.name, b.run), b.name, print) for b in self._bases]
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        began, n = time.monotonic(), 0
        while not self._ended.wait(max(began + n / RATE_HZ - time.monotonic(), 0.0)):
            for k, (box, base) in enumerate(zip(self._boxes, self._bases, strict=True)):
                made = report_at(base, k, n / RATE_HZ)
                box.offer(replace(made, status="lost") if k == 0 else made)
            n += 1

    def close(self) -> list[str]:
        """End; the line of each outbox."""
        self._ended.set()
        self._thread.join(10.0)
        return [box.close() for box in self._boxes]


class Listening:
    """Messages that a commander receives, for the figures."""

    def __init__(self, url: str) -> None:
        self.roster, self._inbox = Roster(), Inbox()
        self.receiver = ListenerThread(Listener(parse_endpoint(url), ["echostep/+/+/+"], self._inbox.put), print)

    def member(self, name: str) -> Member | None:
        """The newest of a wearer."""
        update_roster(self._inbox, self.roster)
        return next((m for m in self.roster.members(time.monotonic()) if m.report.name == name), None)

    def mayday_s(self) -> float | None:
        """Time without movement of the fallen wearer at its mayday (s); None without a mayday."""
        m = self.member("fallen")
        alarm = m.report.alarm if m else None
        return alarm.age_s if m and alarm and m.state(time.monotonic()) is MemberState.MAYDAY else None


class Commander:
    """`echostep command` in a process: its page is at `address`, `recording` is what it writes."""

    def __init__(self, opened: ExitStack, url: str, plan_path: Path, port: int, out: Path, log: Path) -> None:
        self._log = log
        words = ["command", url, "--plan", str(plan_path), "--json", "--port", str(port), "--out", str(out)]
        self._running = start_python(opened, ["-m", "echostep", *words], log)
        recording = wait_for(lambda: self._line("Recording: "), LONGEST_S)
        if not recording:
            sys.exit(f"the commander has not started: {log.read_text().strip()}")
        self.recording, self.address = Path(recording), self._line("The page: ") or ""

    def _line(self, begin: str) -> str | None:
        """The rest of a line of its messages; empty when it has ended."""
        lines = self._log.read_text().splitlines()
        found = [line.removeprefix(begin) for line in lines if line.startswith(begin)]
        return found[0] if found else "" if self._running.poll() is not None else None

    def finish(self) -> tuple[dict[str, list[dict[str, object]]], dict[str, list[str]]]:
        """End it; the roster, and the events of each crew."""
        self._running.send_signal(signal.SIGINT)
        roster = json.loads(self._running.communicate(timeout=30)[0])
        return roster, crews_written(self.recording.with_name(f"{self.recording.stem}-crews.csv"))


def operate(url: str, wearers: int, firmware: int, speed: float, port: int, folders: tuple[Path, Path]) -> bool:
    """Run the operation and print its figures; whether all of it happened. `folders`: for the commander's files, and for what is not kept."""
    plan, began, (kept, folder) = load_plan(PLAN), time.monotonic(), folders
    with ExitStack() as opened:
        ear = Listening(url)
        opened.callback(ear.receiver.close)
        commander = Commander(opened, url, PLAN, port, kept / "operation.mcap", folder / "commander.txt")
        print(f"The commander's page (simulated wearers), for about two minutes: {commander.address}", flush=True)
        crews = SimulatedCrews(ear.receiver.send)
        crews.begin()
        for k in range(firmware):
            out, name = str(folder / f"firmware-{k}"), f"firmware {k}"
            start_python(opened, ["-m", "echostep", "demo", "--headless", "--speed", "1", "--board-command", " ".join(TWIN), "--publish", url,
                            "--name", name, "--team", "load", "--seed", str(k + 1), "--out", out])  # fmt: skip
        crowd = Crowd(url, plan, wearers - firmware - 2)
        walks = ["-m", "reliability.team_operation", "--url", url, "--speed", str(speed), "--role"]
        start_python(opened, [*walks, "fallen"])
        told_s = wait_for(ear.mayday_s, LONGEST_S)
        rescuer = start_python(opened, [*walks, "rescuer"])
        crews.rescue()
        out, _ = rescuer.communicate(timeout=LONGEST_S)
        arrived = json.loads(out.splitlines()[-1])
        state, events = commander.finish()  # before the wearers end
        summaries = crowd.close()
    print(f"To see it again: echostep command {shlex.quote(str(commander.recording))} --plan {PLAN}")
    return judge(state, summaries, told_s, arrived, events, wearers, time.monotonic() - began)


def judge(
    state: dict[str, list[dict[str, object]]], summaries: Sequence[str], told_s: float | None,
    arrived: dict[str, str], crews: dict[str, list[str]], wearers: int, span_s: float,
) -> bool:  # fmt: skip
    """Print what happened; whether all of it did."""
    members = {str(m["name"]): m for m in state["members"]}
    states = [m["state"] for m in state["members"]]
    cpu = resource.getrusage(resource.RUSAGE_CHILDREN)
    first = ", ".join(f"{m['name']} ({m['state']})" for m in state["members"][:2])
    all_sent = sum(", 0 unsent" in line for line in summaries)
    checks = {
        f"{len(members)} of {wearers} wearers with the commander": len(members) == wearers,
        f"first in the list: {first}": states[:2] == ["mayday", "lost"],
        f"mayday after {told_s or 0.0:.1f} s without motion": told_s is not None and 30.0 <= told_s <= 35.0,
        f"rescuer: {arrived['cue']}": arrived["kind"] == CueKind.ARRIVED.value,
        f"{all_sent} of {len(summaries)} simulated wearers sent all": all_sent == len(summaries),
        f"crews in the commander's table: {', '.join(crews)}; {RESCUE}: {', '.join(crews.get(RESCUE, ()))}": (
            crews.keys() == {RESCUE, *(name for name, *_ in INSIDE)} and crews[RESCUE] == ["entered", "checked"]
        ),
    }
    for words, holds in checks.items():
        print(f"{'ok ' if holds else 'NOT'} {words}")
    missed = sum(int(str(m["missed"])) for m in members.values())
    print(f"{missed} reports missed by the commander")
    print(
        f"{span_s:.0f} s on {os.cpu_count()} cores; the processes took {100.0 * (cpu.ru_utime + cpu.ru_stime) / span_s:.0f} % of one core"
    )
    return all(checks.values())


def main() -> None:
    """Run the broker, operate."""
    asked = options(
        __doc__,
        wearers=(20, "of the team"),
        firmware=(2, "wearers with the real firmware in the twin"),
        speed=(1.0, "times real time, of the fallen wearer and of the rescuer"),
        port=(PORT, "of the commander's page"),
        out=("out/operation", "folder of the commander's recording and table of crews"),
        role=("", "internal: one wearer"),
        url=("", "internal: the broker"),
    )
    with ExitStack() as opened:
        if asked.role:
            walk(asked.role, asked.url, load_plan(PLAN), asked.speed)
            return
        url = opened.enter_context(broker())
        print(
            "Preparing: kernels that are not compiled yet are compiled once, not by four wearers at a time", flush=True
        )
        Tracker(load_plan(PLAN)).warm_up()
        folder = Path(opened.enter_context(tempfile.TemporaryDirectory()))
        happened = operate(url, asked.wearers, asked.firmware, asked.speed, asked.port, (Path(asked.out), folder))
    sys.exit(0 if happened else 1)


if __name__ == "__main__":
    main()
