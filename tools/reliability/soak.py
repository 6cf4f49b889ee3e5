# SPDX-License-Identifier: MIT
"""A working day through the real firmware and the host's live pipeline: memory, losses, the wrap of the board's clock, and the replay.

A stray edge a minute is on the input of SyncOut; the board's clock starts `BEFORE_WRAP_S` before a wrap. In: the sources of the firmware, and the
twin; simulated hours. Out: figures with their limits, PASS or FAIL; exit status 1 when one is missed. Owns the limits.

The stages are those of `echostep live` from the ports on: check-ins, recording, subscription, tracker, page with a client, derived messages. In
the place of the ports are the twin's and the MTx's bytes in simulated time, as fast as they are used, and `PORTION` chunks are tracked
together, as in a replay: a live run tracks each for itself, and the estimates are the same.
"""

from __future__ import annotations

import subprocess
import sys
import time
from collections import deque
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import cast

import numpy as np

from echostep.arrays import Floats
from echostep.board import messages as m
from echostep.board.frames import encode
from echostep.localization.estimate import TrackStatus
from echostep.plan.model import load_plan
from echostep.ports.chunks import BOARD, Chunk
from echostep.tracker import Tracker
from echostep.walk.recorded import SIMULATED
from echostep_app.page.server import Address
from echostep_app.ports.serial_ports import SerialPorts
from echostep_app.session.chunk_streams import portions_of
from echostep_app.session.metadata import clock_metadata, run_metadata
from echostep_app.session.options import OutputOptions
from echostep_app.session.runs.live import _recorded_chunks
from echostep_app.session.runs.recording import start_recording
from echostep_app.session.session import Session
from echostep_app.simulation.devices.board import BoardProcess
from places import OUT, PLAN, TWIN
from reliability.campaign import options, report
from reliability.long_tour import LongTour, TracedBoard
from twin.late_clock import HALF_WRAP, TICKS_S, WRAP, late_firmware

SEED = 1
PORTION = 100  # chunks that are tracked together: about a tenth of a second
SAMPLE_S = 60.0  # simulated, between two looks at the memory
SETTLED_S = 1800.0  # from then on memory must not grow
BEFORE_WRAP_S = 60.0  # a stray edge lies before and behind it
WRAPS = {"half": HALF_WRAP, "whole": WRAP}  # where comparisons of two times turn round, and where the clock itself does
# Limits: what a day of 24 h may cost.
HOST_MB_H, TWIN_MB_H = 8.0, 0.1
SURE_M = 1.0
FRAME_S = 10.0  # simulated, between two frames of the page at the least; live it gets 30 a second

# A page: it reports each frame as drawn, or it would get no more of them.
CLIENT = """
import contextlib, json, sys
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
from websockets.typing import Origin
url, frames = sys.argv[1], 0
with connect(f"ws{url[4:]}socket", origin=Origin("/".join(url.split("/")[:3])), max_size=None) as page:
    with contextlib.suppress(ConnectionClosed):
        for received in page:
            if isinstance(received, bytes):
                frames += 1
                header = json.loads(received[4 : 4 + int.from_bytes(received[:4], "little")])
                page.send(json.dumps({"kind": "drawn", "seq": header["seq"]}))
print(frames)
"""


@dataclass
class Measured:
    """What a run was like. `memory` (n, 3): simulated seconds, MB of host and twin; `wraps` of the board's clock."""

    seconds: float = 0.0
    wall_s: float = 0.0
    memory: list[tuple[float, float, float]] = field(default_factory=list)
    wraps: int = 0
    first: tuple[float, int] | None = None  # simulated seconds and the board's clock at the first look
    last_ticks: int = 0
    losses: dict[str, int] = field(default_factory=dict)
    frames: int = 0  # that the page's client has drawn
    recorded_mb: float = 0.0
    estimates: int = 0
    tracking: float = 0.0
    wrongly_sure: int = 0
    worst_m: float = 0.0
    replays: bool = False


class TourPorts:
    """The ports as `live` uses them: the tour's chunks up to a time, and a way to the board.

    Once a minute of the tour memory is measured, and a stray edge disturbs the board's SyncOut input.
    """

    names = (BOARD,)  # the MTx is set up already

    def __init__(self, tour: LongTour, seconds: float, tracker: Tracker, twin_pid: int, measured: Measured) -> None:
        self.urls: dict[str, str] = {}
        self.notices: deque[str] = deque()
        self._tour, self._seconds, self._tracker = tour, seconds, tracker
        self._twin_pid, self._measured = twin_pid, measured

    def send(self, _port: str, sent: bytes) -> None:
        """To the board."""
        self._tour.board.send(sent)

    def chunks(self) -> Iterator[Chunk]:
        """In order of arrival."""
        due_s = 0.0
        for chunk in self._tour.chunks():
            if self._tour.t_s >= due_s:
                due_s += min(SAMPLE_S, self._seconds / 20.0)
                self._look()
                self._tour.board.fault("glitch=left")  # an edge on D4 that is none of SyncOut's
            if self._tour.t_s >= self._seconds:
                return
            yield chunk

    def _look(self) -> None:
        measured, status = self._measured, self._tracker.streams.status
        measured.memory.append((self._tour.t_s, resident_mb("self"), resident_mb(str(self._twin_pid))))
        if status is None:
            return
        if measured.first is None:
            measured.first, measured.last_ticks = (self._tour.t_s, status.ticks), status.ticks
        measured.wraps += status.ticks < measured.last_ticks
        measured.last_ticks = status.ticks


def resident_mb(process: str) -> float:
    """Resident memory of a process [proc(5)]."""
    pages = int(Path(f"/proc/{process}/statm").read_text().split()[1])
    return pages * 4096 / 1e6


def run(seconds: float, folder: Path, board: TracedBoard | None = None, began_s: float = 0.0) -> Measured:
    """Walk so many simulated seconds, with the real firmware unless another board is given, whose clock is at `began_s`. Files go into `folder`."""
    plan, measured = load_plan(PLAN), Measured(seconds)
    tour = LongTour(plan, SEED, board or BoardProcess([*TWIN, "--seed", str(SEED)]))
    tracker = Tracker(plan, tour.start, seed=SEED)
    output = OutputOptions(folder, terminal=False, page=Address(port=0))
    began = time.perf_counter()
    with ExitStack() as watched, ExitStack() as stack:
        stack.callback(tour.board.close)
        session = Session(tracker, "echostep soak (simulated)", "live", output)
        session.prepare()
        stack.enter_context(session)
        assert session.page
        client = subprocess.Popen([sys.executable, "-c", CLIENT, session.page.url], stdout=subprocess.PIPE, text=True)
        watched.callback(client.kill)
        session.page.wait_for_page()
        ports = TourPorts(tour, seconds, tracker, tour.board.pid, measured)
        metadata = run_metadata(plan, tracker.start, SEED, "soak", source=SIMULATED) | clock_metadata()
        with start_recording(folder / "walk.mcap", metadata) as recorder:
            tour.board.send(encode(m.Identify(), 0))
            chunks = _recorded_chunks(cast("SerialPorts", ports), recorder, 100.0, None, session)
            session.track(portions_of(chunks, PORTION), None, recorder)
        session.finish("soak")
        stack.close()  # the page's client ends with the page
        measured.frames = int(client.communicate()[0] or 0)
        measured.losses = losses(tracker) | {
            "recorder: chunks": recorder.lost_chunks,
            "recorder: derived messages": recorder.skipped_messages,
        }
    measured.wall_s = time.perf_counter() - began
    measured.recorded_mb = (folder / "walk.mcap").stat().st_size / 1e6
    judge(measured, session, tour, began_s)
    return measured


def run_before_wrap(seconds: float, folder: Path, wrap: int, before_s: float = BEFORE_WRAP_S) -> Measured:
    """`run` with the real firmware, whose clock starts so many seconds before it reaches `wrap`."""
    start = wrap - round(before_s * TICKS_S)
    elf = late_firmware(start, folder / "firmware")
    board = BoardProcess([TWIN[0], "--elf", str(elf), "--seed", str(SEED)])
    return run(seconds, folder, board, start / TICKS_S)


def losses(tracker: Tracker) -> dict[str, int]:
    """Everything that counts a loss, of board, MTx and host, by name."""
    streams = tracker.streams
    counts = {
        f"board: {k}": v for k, v in (streams.status._asdict() if streams.status else {}).items() if "dropped" in k
    }
    counts |= {"board: frames lost": streams.board.lost, "board: frames rejected": streams.board.rejected}
    return counts | {f"MTx: {name}": count for name, count in asdict(streams.mtx).items() if name != "good"}


def judge(measured: Measured, session: Session, tour: LongTour, began_s: float) -> None:
    """Compare the estimates with the true path, which begins at `began_s` of the board's clock."""
    estimates = session.estimates
    measured.estimates = len(estimates)
    t_s = np.array([e.t_s for e in estimates]) - began_s
    xy_m = np.array([(e.x_m, e.y_m) for e in estimates])
    sure = np.array([e.status is TrackStatus.TRACKING for e in estimates])
    off_m: Floats = np.hypot(*(xy_m - tour.true_m(t_s)).T)
    measured.tracking, measured.worst_m = float(sure.mean()), float(off_m.max())
    measured.wrongly_sure = int((off_m[sure] > SURE_M).sum())


def replays(folder: Path) -> bool:
    """Whether a replay of the recording gives the live track, byte for byte."""
    command = [sys.executable, "-m", "echostep", "replay", str(folder / "walk.mcap"), "--plan", str(PLAN)]
    subprocess.run([*command, "--headless", "--out", str(folder / "again")], check=True, stdout=subprocess.DEVNULL)
    return (folder / "again/track.csv").read_bytes() == (folder / "track.csv").read_bytes()


def slope_mb_h(t_s: Floats, mb: Floats) -> float:
    """Growth of the memory by a straight line."""
    return float(np.polyfit(t_s / 3600.0, mb, 1)[0])


def figures(measured: Measured) -> list[tuple[str, str, str, bool | None]]:
    """(what, measured, limit, passed) for every figure."""
    t_s, host, twin = np.array(measured.memory).T
    settled = t_s >= min(SETTLED_S, measured.seconds / 2.0)
    results: list[tuple[str, str, str, bool | None]] = []
    for name, mb, most in (("host", host[settled], HOST_MB_H), ("twin", twin[settled], TWIN_MB_H)):
        growth = slope_mb_h(t_s[settled], mb)
        text = f"{mb[0]:.1f} MB after {t_s[settled][0] / 60:.0f} min, {mb[-1]:.1f} MB at the end, {growth:+.2f} MB/h"
        results.append((f"memory of the {name}", text, f"<= {most:g} MB/h", growth <= most))
    first_s, first_ticks = measured.first or (0.0, 0)
    wraps = (first_ticks + round((t_s[-1] - first_s) * TICKS_S)) // WRAP
    lost = {name: count for name, count in measured.losses.items() if count}
    speed, shown = measured.seconds / measured.wall_s, measured.seconds / FRAME_S
    return [
        *results,
        ("wraps of the board's clock", f"{measured.wraps}", f"{wraps}", measured.wraps == wraps),
        ("lost or dropped, anywhere", str(lost or 0), "0", not lost),
        ("replay is the live track", "yes" if measured.replays else "no", "yes", measured.replays),
        ("estimates", f"{measured.estimates}, {100 * measured.tracking:.1f} % tracking", "> 0", measured.estimates > 0),
        ("tracking and over 1 m off", f"{measured.wrongly_sure}", "0", measured.wrongly_sure == 0),
        ("worst error", f"{measured.worst_m:.2f} m", "-", None),
        ("frames that a page drew", f"{measured.frames}", f">= {shown:.0f}", measured.frames >= shown),
        ("recording", f"{measured.recorded_mb:.0f} MB", "-", None),
        ("time", f"{measured.wall_s / 60:.1f} min, {speed:.0f} x real time", "-", None),
    ]


def main() -> int:
    asked = options(
        __doc__,
        hours=(8.0, "simulated"),
        out=(OUT / "soak", "folder"),
        wrap=(next(iter(WRAPS)), "of the board's clock, before which it starts: half, whole"),
    )
    asked.out.mkdir(parents=True, exist_ok=True)
    measured = run_before_wrap(3600.0 * asked.hours, asked.out, WRAPS[asked.wrap])
    measured.replays = replays(asked.out)
    return report(f"{asked.hours:g} simulated hours", figures(measured))


if __name__ == "__main__":
    sys.exit(main())
