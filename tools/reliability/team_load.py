# SPDX-License-Identifier: MIT
"""CPU load of a team: trackers that publish over MQTT, and two commanders that receive their reports.

In: number of trackers, rate, duration. Out: figures on the terminal. Owns a Mosquitto broker on a free loopback port. The trackers are threads that
publish simulated reports through the code of `--publish`; one commander draws its table on a pseudo terminal, the other prints JSON.
"""

from __future__ import annotations

import json
import math
import os
import resource
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from echostep.plan.model import Plan, load_plan
from echostep_app.team.endpoint import parse_endpoint
from echostep_app.team.messages.report import Motion, Position, Report, StreamReport
from echostep_app.team.mqtt.publisher import MqttTransport
from echostep_app.team.outbox import Outbox
from echostep_app.team.publish import empty_report
from places import PLAN
from reliability.broker import broker
from reliability.campaign import options

TICKS = os.sysconf("SC_CLK_TCK")


def report_at(base: Report, k: int, t_s: float) -> Report:
    """A report of a wearer who walks in a circle."""
    x_m, y_m = 10.0 + 5.0 * math.cos(0.2 * t_s + k), 5.0 + 3.0 * math.sin(0.2 * t_s + k)
    position = Position(t_s, 0.0, x_m, y_m, 0.04, 0.0, 0.04, 0.5, 0.0, 0.1, 0, "Ground floor", 1.0, 0.0, 0.1)
    motion, streams = Motion(int(t_s), t_s, 1.0, 0.0), StreamReport(100.0, 360.0, 0, 0, 0, True, ())
    return replace(base, status="tracking", position=position, motion=motion, streams=streams)


def publish(url: str, plan: Plan, trackers: int, rate_hz: float, seconds: float) -> list[str]:
    """Run all trackers in this process; returns their summaries."""
    bases = [empty_report(plan, f"tracker {k:02d}", "load", f"{k:08x}", "simulated") for k in range(trackers)]
    boxes = [Outbox(MqttTransport(parse_endpoint(url), b.team, b.name, b.run), b.name, print) for b in bases]
    began = time.monotonic()
    for n in range(int(rate_hz * seconds)):
        for k, (box, base) in enumerate(zip(boxes, bases, strict=True)):
            box.offer(report_at(base, k, n / rate_hz))
        time.sleep(max(began + (n + 1) / rate_hz - time.monotonic(), 0.0))
    return [box.close() for box in boxes]


def flood(port: int, rate_hz: float, ended: threading.Event) -> None:
    """Send the same invalid report `rate_hz` times a second until `ended`, at QoS 0, by a plain socket [MQTT 3.1.1, 3.1 and 3.3]."""
    payload, topic = b'{"echostep_report":1,"team":"evil"}' + b" " * 700, b"echostep/evil/eve/estimate"
    rest = struct.pack(">H", len(topic)) + topic + payload
    packets = (b"\x30" + bytes([len(rest) & 127 | 128, len(rest) >> 7]) + rest) * 100
    with socket.create_connection(("127.0.0.1", port)) as sock:
        sock.sendall(b"\x10\x10\x00\x04MQTT\x04\x02\x00\x3c\x00\x04evil")
        began, sent = time.monotonic(), 0
        while not ended.is_set():
            sock.sendall(packets)
            sent += 100
            time.sleep(max(began + sent / rate_hz - time.monotonic(), 0.0))


def drain(descriptor: int) -> None:
    """Read a pseudo terminal until it is closed."""
    try:
        while os.read(descriptor, 65_536):
            pass
    except OSError:
        return


def cpu_s(pid: int) -> float:
    """Seconds of CPU that a running child has used [proc(5)]."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICKS


def start_commander(url: str, plan_path: Path, out: Path, *more: str, terminal: bool) -> subprocess.Popen[str]:
    """Start a commander, on a pseudo terminal or with its output kept."""
    command = [sys.executable, "-m", "echostep", "command", "--plan", str(plan_path), url, "--out", str(out), *more]
    if not terminal:
        return subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    ours, theirs = os.openpty()
    threading.Thread(target=drain, args=(ours,), daemon=True).start()
    running = subprocess.Popen(command, stdout=theirs, text=True, env=os.environ | {"COLUMNS": "140", "TERM": "xterm"})
    os.close(theirs)
    return running


def wait_for_recordings(folder: Path, commanders: Sequence[subprocess.Popen[str]]) -> None:
    """Until all of them record, and a second more, in which they subscribe."""
    while len(list(folder.glob("*.mcap"))) < len(commanders):
        if any(commander.poll() is not None for commander in commanders):
            raise SystemExit("a commander has ended by itself")
        time.sleep(0.1)
    time.sleep(1.0)


def measure(
    url: str, plan_path: Path, folder: Path, trackers: int, rate_hz: float, seconds: float, flood_hz: float
) -> None:
    """Run two commanders, one with its table, one with JSON, and the trackers; print CPU shares and message counts."""
    drawing = start_commander(url, plan_path, folder / "table.mcap", terminal=True)
    printing = start_commander(url, plan_path, folder / "roster.mcap", "--json", terminal=False)
    wait_for_recordings(folder, (drawing, printing))
    before_s, mine_s = (cpu_s(drawing.pid), cpu_s(printing.pid)), sum(resource.getrusage(resource.RUSAGE_SELF)[:2])
    began = time.monotonic()
    ended = threading.Event()
    if flood_hz:
        port = int(url.rpartition(":")[2])
        threading.Thread(target=flood, args=(port, flood_hz, ended), daemon=True).start()
    summaries = publish(url, load_plan(plan_path), trackers, rate_hz, seconds)
    ended.set()
    span_s = time.monotonic() - began
    after_s, ours_s = (cpu_s(drawing.pid), cpu_s(printing.pid)), sum(resource.getrusage(resource.RUSAGE_SELF)[:2])
    for commander in (drawing, printing):
        commander.send_signal(signal.SIGINT)
    out, _ = printing.communicate(timeout=30)
    drawing.wait(30)
    roster = json.loads(out)
    late = sum("0 overtaken" not in s or "0 unsent" not in s for s in summaries)
    print(f"{trackers} trackers x {rate_hz:g} estimates/s for {span_s:.0f} s on {os.cpu_count()} cores")
    for name, after, before in zip(("with its table", "roster only"), after_s, before_s, strict=True):
        print(f"commander, {name}: {100.0 * (after - before) / span_s:.1f} % of one core")
    if not flood_hz:
        print(f"publishing, each tracker: {100.0 * (ours_s - mine_s) / span_s / trackers:.2f} % of one core")
    followed = [m for m in roster["members"] if m["team"] == "load"]
    missed, refused = sum(m["missed"] for m in followed), sum(roster["not_believed"].values())
    print(f"{roster['heard']} messages received, {refused} rejected")
    print(
        f"{len(followed)} trackers shown, {missed} of their reports missed; {late} trackers with overtaken or unsent reports"
    )


def main() -> None:
    """Run the broker, measure."""
    asked = options(
        __doc__, trackers=(20, "how many"), rate=(10.0, "reports of each a second"), seconds=(30.0, "of publishing"),
        flood=(0.0, "invalid messages per second besides"),
    )  # fmt: skip
    with broker() as url, TemporaryDirectory() as folder:
        measure(url, PLAN, Path(folder), asked.trackers, asked.rate, asked.seconds, asked.flood)


if __name__ == "__main__":
    main()
