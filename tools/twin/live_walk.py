# SPDX-License-Identifier: GPL-3.0-or-later
"""A simulated walk in real time through `echostep live`, with one fault of the host in it.

In: a fault, an empty folder. Out: its outcome, judged from the recordings and tracks that the runs wrote. Owns the twin, the MTx and the live runs.
The ports have names of their own in the folder, as udev's links in /dev/serial/by-id, for a pseudo terminal that returns may have another name.
"""

from __future__ import annotations

import csv
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any, NamedTuple, Self, cast

import numpy as np
from numpy.typing import NDArray

from echostep.arrays import Floats
from echostep.board.frames import BoardReader
from echostep.plan import load_plan
from echostep.recording import open_recording
from echostep_app.ports.arrival_clock import now_ns
from echostep_simulation.scenario import demo_scenario
from echostep_simulation.stimulus import BoardSensors
from places import PLAN
from reliability.fault_outcomes import NORMAL_S, FaultOutcome, heard, judge_estimates, judge_streams
from twin.run import PtyBoard, PtyMtx, playing, wait_for_opening

SEED = 1
# Of the walk: the fault begins while the wearer walks in a corridor; the last second that is judged.
BEGIN_S, END_S = 20.0, 50.0
TAIL_S = 10.0  # that the walk goes on after the last judged second: a run that is behind uses its bytes meanwhile
LEAST_GAP_S = 0.5  # shorter ones are the pace of a computer that does other things too
LEAST_BYTES = 10_000  # of a recording that has begun: half a second of both ports
ENDING_S = 60.0  # longest wait for a run to write its files
LIVE = (sys.executable, "-m", "echostep")


class HostFault(NamedTuple):
    """What `begin` does at BEGIN_S, and `end` after `seconds` (None: it stays). `program`: in the place of LIVE."""

    name: str
    begin: Callable[[LiveWalk], None] | None = None
    end: Callable[[LiveWalk], None] | None = None
    seconds: float = 0.0
    program: Sequence[str] = LIVE
    prepare: Callable[[LiveWalk], None] | None = None  # before the run starts

    @property
    def title(self) -> str:
        """The name with the duration."""
        return self.name + (f" for {self.seconds:g} s" if self.end else "")

    @property
    def slug(self) -> str:
        """The title as the name of a folder."""
        return "".join(c if c.isalnum() else "_" for c in self.title)


class KnownRows(NamedTuple):
    """All rows of a walk, so that none is computed while it is played."""

    table: NDArray[Any]

    def rows(self, start: int, stop: int) -> NDArray[Any]:
        """Rows of the milliseconds start..stop-1."""
        return self.table[start:stop]


class LiveWalk:
    """Call `play` once while it is entered. `live`: the newest run; `runs`: the folder of each; `late_s`: how far the walk fell behind the clock."""

    def __init__(self, folder: Path, fault: HostFault, begin_s: float = BEGIN_S, end_s: float = END_S) -> None:
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        self.folder, self.fault = folder, fault
        self.opened = ExitStack()  # closed at the end
        self.output = os.open(folder / "output.txt", os.O_WRONLY | os.O_CREAT)  # of the runs
        self.opened.callback(os.close, self.output)
        self.runs: list[Path] = []
        self.late_s = 0.0
        self.live: subprocess.Popen[bytes] | None = None
        self._begin_s, self._end_s = begin_s, end_s
        self._fault_ns = 0  # when it began, on the clock of the arrivals
        self.board, self.mtx = PtyBoard(), PtyMtx()
        self.opened.callback(self.board.close)
        self.opened.callback(self.mtx.unplug)
        self.link()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self.live is not None:
            self.live.kill()
            self.live.wait()
        self.opened.close()

    def link(self, *, board: bool = True, mtx: bool = True) -> None:
        """Recreate the names of the ports that are plugged in."""
        for name, port, there in (("board", self.board.port, board), ("mtx", self.mtx.port, mtx)):
            (self.folder / name).unlink(missing_ok=True)
            if there:
                (self.folder / name).symlink_to(port)

    def start(self, *options: str) -> None:
        """Start a live run, in a folder of its own."""
        self.runs.append(self.folder / f"run{len(self.runs) + 1}")
        self.runs[-1].mkdir(exist_ok=True)
        ports = ("--board", str(self.folder / "board"), "--mtx", str(self.folder / "mtx"))
        command = [*self.fault.program, "live", "--plan", str(PLAN), *ports, "--out", str(self.runs[-1])]
        self.live = subprocess.Popen([*command, "--headless", *options], stdout=self.output, stderr=subprocess.STDOUT)

    @property
    def process(self) -> subprocess.Popen[bytes]:
        """The newest run."""
        assert self.live is not None
        return self.live

    def play(self) -> FaultOutcome:
        """Walk up to the end, and judge."""
        scenario = demo_scenario(load_plan(PLAN), SEED, self.board)
        scenario.sensors = cast("BoardSensors", KnownRows(scenario.sensors.rows(0, len(scenario.walk.t_s))))
        (self.folder / "run1").mkdir()
        if self.fault.prepare:
            self.fault.prepare(self)
        self.start()
        wait_for_opening(self.board, self.mtx, lambda: self.process.poll() is None)
        began_s, fault_s, now_s = self.board.t_s, np.inf, 0.0
        due = [(self._begin_s, self.fault.begin), (self._begin_s + self.fault.seconds, self.fault.end)]
        for now_s in playing(scenario, self.board, self.mtx):
            while due and now_s >= due[0][0]:
                if len(due) == 2:
                    self._fault_ns, fault_s = now_ns(), self.board.t_s
                if act := due.pop(0)[1]:
                    act(self)
            if now_s >= self._end_s + TAIL_S and self._has_begun():
                break
        self.late_s = self._walk_s(now_ns()) - now_s
        self.process.send_signal(signal.SIGTERM)
        self.process.wait(ENDING_S)
        return self._outcome(scenario.truth[:, :3] + [began_s, 0.0, 0.0], fault_s)

    def _has_begun(self) -> bool:
        """Whether the newest run has recorded something, or has ended: on a busy computer it may take longer to begin than the walk."""
        recorded = self.runs[-1] / "walk.mcap"
        return self.process.poll() is not None or (recorded.exists() and recorded.stat().st_size > LEAST_BYTES)

    def _outcome(self, truth: Floats, fault_s: float) -> FaultOutcome:
        """Judge the recordings of all runs, and their tracks; that of a killed run is its replay."""
        outcome, times_s = FaultOutcome(self.fault.title), {name: list[float]() for name in NORMAL_S}
        tracks: list[Floats] = []
        for run in self.runs:
            reader = BoardReader()
            for _ in heard(open_recording(run / "walk.mcap").chunks(), reader, times_s, self._walk_s):
                pass
            outcome.lost_frames += reader.counts.lost + reader.counts.rejected
            if not (run / "track.csv").exists():
                replay(run)
            tracks.append(track(run))
        judge_streams(outcome, times_s, self._begin_s, self._end_s, LEAST_GAP_S)
        judged = np.vstack(tracks)
        judged = judged[judged[:, 0] >= fault_s]
        judge_estimates(outcome, judged[:, 0], judged[:, 1:3], judged[:, 3] > 0.0, truth)
        return outcome

    def _walk_s(self, t_arrival_ns: int) -> float:
        """Seconds of the walk at an arrival time."""
        return self._begin_s + (t_arrival_ns - self._fault_ns) * 1e-9


def replay(run: Path) -> None:
    """Track what a run has recorded; its files go beside the recording."""
    command = [*LIVE, "replay", str(run / "walk.mcap"), "--plan", str(PLAN), "--out", str(run), "--headless"]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)


def track(run: Path) -> Floats:
    """Estimates of a run (n, 4): t_s, x, y, 1 for `tracking`."""
    with (run / "track.csv").open() as file:
        rows = [(r["t_s"], r["x_m"], r["y_m"], r["status"] == "tracking") for r in csv.DictReader(file)]
    return np.array(rows, np.float64).reshape(-1, 4)
