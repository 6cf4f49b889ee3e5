# SPDX-License-Identifier: GPL-3.0-or-later
"""The faults of the host that `make faults` plays during a live run: kills, stops, disks, ports.

In: a walk under way. Out: the fault in it. Owns the list of these faults.
"""

from __future__ import annotations

import contextlib
import os
import resource
import signal
import subprocess
import sys
import threading
from functools import partial

from twin.live_walk import HostFault, LiveWalk, replay, track

DISK_MB = 4  # of the disk that becomes full: a run that records only the ports' bytes needs 2 MB
WRITE_S = 1.0  # that a slow disk takes for each write

# A program in the place of `echostep`.
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
)  # fmt: skip
