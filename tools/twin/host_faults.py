# SPDX-License-Identifier: GPL-3.0-or-later
"""The faults of the host that `make faults` plays during a live run: kills, stops, disks, ports, floods, terminals.

In: a walk under way. Out: the fault in it. Owns the list of these faults.
"""

from __future__ import annotations

import contextlib
import os
import pty
import resource
import select
import signal
import subprocess
import sys
import threading
from functools import partial

from twin.live_walk import LIVE, HostFault, LiveWalk, replay, track

DISK_MB = 4  # of the disk that becomes full: a run that records only the ports' bytes needs 2 MB
WRITE_S = 1.0  # that a slow disk takes for each write

POLL_S = 0.05  # of a terminal
UDP_PORT, PAGE_PORT = 9471, 9472

# Programs in the place of `echostep`, and beside it.
SLOW_DISK = f"""
import sys, time
from pathlib import Path
from echostep_app.cli import main
from echostep_app.recording.background_writer import BackgroundWriter
slow, write = Path(sys.argv[sys.argv.index("--out") + 1]).parent / "slow", BackgroundWriter._write_to_file
def write_slowly(self, data):
    if slow.exists():
        time.sleep({WRITE_S})
    return write(self, data)
BackgroundWriter._write_to_file = write_slowly
main()
"""
DATAGRAMS = """
import socket, sys, time
from echostep.board.frames import encode
from echostep_simulation.devices.beacon_gateway import message
flood, k = socket.socket(socket.AF_INET, socket.SOCK_DGRAM), 0
while True:
    for _ in range(50):
        k += 1
        flood.sendto(bytes(100), ("127.0.0.1", int(sys.argv[1])))
        flood.sendto(encode(message(k % 60000, 1.0 + k % 7, 0.5, 10.0), k % 256), ("127.0.0.1", int(sys.argv[1])))
    time.sleep(0.005)
"""
CONNECTIONS = """
import contextlib, socket, sys, time
kept = []
while True:
    with contextlib.suppress(OSError):
        kept.append(socket.create_connection(("127.0.0.1", int(sys.argv[1])), 1.0))
        if len(kept) % 2:
            kept[-1].sendall(b"GET / HTTP/1.1\\r\\nHost: 127.0.0.1\\r\\n\\r\\n")
    if len(kept) > 300:
        kept.pop(0).close()
    time.sleep(0.001)
"""
UNDER_NOHUP = ("sh", "-c", 'trap "" HUP; exec "$@"', "sh", *LIVE)


def kill(walk: LiveWalk) -> None:
    """End the run by SIGKILL."""
    walk.process.kill()
    walk.process.wait()


def go_on(walk: LiveWalk) -> None:
    """End a stop."""
    walk.process.send_signal(signal.SIGCONT)


def kill_and_search(walk: LiveWalk) -> None:
    """Start again anywhere in the building."""
    kill(walk)
    walk.start("--start", "?")


def kill_and_continue(walk: LiveWalk) -> None:
    """Start again about the last position of the killed run's replay, which a thread makes while the wearer walks on."""
    kill(walk)

    def restart() -> None:
        replay(walk.runs[0])
        x_m, y_m = track(walk.runs[0])[-1, 1:3]
        walk.start("--start", f"{x_m:.2f},{y_m:.2f},0", "--start-sd", "6,180")

    thread = threading.Thread(target=restart)
    thread.start()
    walk.opened.callback(thread.join)


def fill_disk(walk: LiveWalk) -> None:
    """Use up the rest of the disk; where none could be mounted, let the run's files not grow."""
    if os.path.ismount(walk.runs[0]):
        with contextlib.suppress(OSError), (walk.runs[0] / "filler").open("wb", buffering=0) as filler:
            while True:
                filler.write(bytes(1024))
    else:
        limit_file(walk)


def free_disk(walk: LiveWalk) -> None:
    """Give the space back."""
    (walk.runs[0] / "filler").unlink(missing_ok=True)
    most = resource.prlimit(walk.process.pid, resource.RLIMIT_FSIZE)[1]
    resource.prlimit(walk.process.pid, resource.RLIMIT_FSIZE, (most, most))


def limit_file(walk: LiveWalk) -> None:
    """No file of the run may become longer than its recording is now."""
    most = resource.prlimit(walk.process.pid, resource.RLIMIT_FSIZE)[1]
    resource.prlimit(walk.process.pid, resource.RLIMIT_FSIZE, ((walk.runs[0] / "walk.mcap").stat().st_size, most))


def mount_disk(walk: LiveWalk) -> None:
    """A small file system for the run; it needs root."""
    place = walk.folder / "run1"
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", f"size={DISK_MB}m", "tmpfs", place], check=False, capture_output=True
    )
    if mounted.returncode:
        print("no right to mount a small disk: the recording's size is limited instead", file=sys.stderr)
    else:
        walk.opened.callback(subprocess.check_call, ["umount", str(place)])


def unplug(walk: LiveWalk, *, board: bool = False, mtx: bool = False) -> None:
    """Pull the cables of these ports."""
    if board:
        walk.board.fault("usb=unplug")
    if mtx:
        walk.mtx.unplug()
    walk.link(board=not board, mtx=not mtx)


def plug(walk: LiveWalk, *, board: bool = False, mtx: bool = False) -> None:
    """Plug them in again; its cable feeds the MTx, too, so that it restarts."""
    if board:
        walk.board.fault("usb=plug")
    if mtx:
        walk.mtx.plug()
        walk.mtx.power_on()
    walk.link()


unplug_mtx, plug_mtx = partial(unplug, mtx=True), partial(plug, mtx=True)


class Flood:
    """A program that floods a port, in a process of its own."""

    def __init__(self, program: str, port: int) -> None:
        self._command = [sys.executable, "-c", program, str(port)]
        self._process: subprocess.Popen[bytes] | None = None

    def begin(self, walk: LiveWalk) -> None:
        """Start it."""
        self._process = subprocess.Popen(self._command)
        walk.opened.callback(self.end, walk)

    def end(self, _walk: LiveWalk) -> None:
        """End it."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()


class Terminal:
    """A terminal for the run; what the run prints is read all the time."""

    def __init__(self) -> None:
        self._ours = -1
        self._reads, self._over = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._read)

    def prepare(self, walk: LiveWalk) -> None:
        """Open it."""
        self._ours, walk.output = pty.openpty()
        self._reads.set()
        self._thread.start()
        walk.opened.callback(os.close, walk.output)
        walk.opened.callback(self.close, walk)

    def _read(self) -> None:
        while not self._over.is_set():
            if self._reads.wait(POLL_S) and select.select([self._ours], [], [], POLL_S)[0]:
                os.read(self._ours, 1 << 16)

    def stop(self, _walk: LiveWalk) -> None:
        """Read nothing, as after Ctrl-S or over a network that hangs."""
        self._reads.clear()

    def go_on(self, _walk: LiveWalk) -> None:
        """Read again."""
        self._reads.set()

    def close(self, _walk: LiveWalk) -> None:
        """Close it: each write of the run to it fails from now on."""
        if not self._over.is_set():
            self._over.set()
            self._thread.join()
            os.close(self._ours)


DATAGRAM_FLOOD, CONNECTION_FLOOD = Flood(DATAGRAMS, UDP_PORT), Flood(CONNECTIONS, PAGE_PORT)
STOPPED, CLOSED = Terminal(), Terminal()
HOST_FAULTS = (
    HostFault("live, nothing"),
    HostFault("live, `kill -9`; started again with `--start '?'`", kill_and_search),
    HostFault("live, `kill -9`; started again about the last position of its replay", kill_and_continue),
    HostFault("live, stopped (SIGSTOP)", lambda walk: walk.process.send_signal(signal.SIGSTOP), go_on, 3.0),
    HostFault("live, stopped (SIGSTOP)", lambda walk: walk.process.send_signal(signal.SIGSTOP), go_on, 10.0),
    HostFault(
        f"live, disk that takes {WRITE_S:g} s a write",
        lambda walk: (walk.folder / "slow").touch(), lambda walk: (walk.folder / "slow").unlink(), 10.0,
        program=(sys.executable, "-c", SLOW_DISK),
    ),
    HostFault("live, disk full", fill_disk, free_disk, 10.0, prepare=mount_disk),
    HostFault("live, recording refused from then on (RLIMIT_FSIZE)", limit_file),
    HostFault("live, board's port unplugged", partial(unplug, board=True), partial(plug, board=True), 3.0),
    HostFault("live, MTx's port unplugged", unplug_mtx, plug_mtx, 3.0),
    HostFault("live, both ports unplugged", partial(unplug, board=True, mtx=True), partial(plug, board=True, mtx=True), 3.0),
    HostFault(
        "live, 20,000 datagrams/s to the beacons' port, half of them invented beacons",
        DATAGRAM_FLOOD.begin, DATAGRAM_FLOOD.end, 10.0, ("--headless", "--beacons", f"udp://127.0.0.1:{UDP_PORT}"),
    ),
    HostFault(
        "live, 1000 connections/s to the page",
        CONNECTION_FLOOD.begin, CONNECTION_FLOOD.end, 10.0, ("--port", str(PAGE_PORT)),
    ),
    HostFault("live, terminal that takes nothing", STOPPED.stop, STOPPED.go_on, 10.0, ("--no-page",), prepare=STOPPED.prepare),
    HostFault("live, terminal closed under `nohup`", CLOSED.close, None, 0.0, ("--no-page",), UNDER_NOHUP, CLOSED.prepare),
)  # fmt: skip
