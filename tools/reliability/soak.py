# SPDX-License-Identifier: MIT
"""A working day through the real firmware and the host's live pipeline: memory, losses, the wrap of the board's clock, and the replay.

A stray edge a minute is on the input of SyncOut; the board's clock starts `BEFORE_WRAP_S` before a wrap. In: the sources of the firmware, and the
twin; simulated hours. Out: figures with their limits, PASS or FAIL; exit status 1 when one is missed. Owns the limits.

The stages are those of `echostep live` from the ports on: check-ins, recording, subscription, tracker, page with a client, derived messages. In
the place of the ports are the bytes of `EndlessWalk` in simulated time, as fast as they are used, and `PORTION` chunks are tracked together,
as in a replay: a live run tracks each for itself, and the estimates are the same.
"""

from __future__ import annotations

import subprocess
import sys
import time
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import cast

import numpy as np

from echostep.arrays import Floats
from echostep.board import messages as m
from echostep.board.frames import encode
from echostep.plan import load_plan
from echostep.ports.chunks import BOARD, Chunk
from echostep.timing.timeline import TICKS_PER_S
from echostep.tracker import Tracker
from echostep.walk.recorded import SIMULATED
from echostep_app.page.server import Address
from echostep_app.ports.serial_ports import SerialPorts
from echostep_app.recording.recorder import Recorder
from echostep_app.session.chunk_streams import portions_of
from echostep_app.session.metadata import clock_metadata, run_metadata, start_recording
from echostep_app.session.options import OutputOptions
from echostep_app.session.runs.live import _recorded_chunks
from echostep_app.session.session import Session
from echostep_simulation.devices.board import BoardProcess
from places import OUT, PLAN, TWIN
from reliability.campaign import Figure, none, options, report
from reliability.fault_outcomes import SURE_M, FaultOutcome, columns, judge_estimates
from reliability.soak_walk import EndlessWalk
from twin.late_clock import HALF_WRAP, WRAP, late_firmware

SEED = 1
PORTION = 100  # chunks that are tracked together: about a tenth of a second
SAMPLE_S = 60.0  # simulated, between two looks at the memory
SETTLED_S = 1800.0  # from then on memory must not grow
BEFORE_WRAP_S = 60.0  # a stray edge lies before and behind it
WRAPS = {"half": HALF_WRAP, "whole": WRAP}  # where comparisons of two times turn round, and where the clock itself does
# Limits: what a day of 24 h may cost.
HOST_MB_H, TWIN_MB_H = 8.0, 0.1
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
    """What a run was like. `memory` (n, 3): simulated seconds, MB of host and twin; `clock`: simulated seconds and the board's ticks at each look."""

    seconds: float
    wall_s: float = 0.0
    memory: list[tuple[float, float, float]] = field(default_factory=list)
    clock: list[tuple[float, int]] = field(default_factory=list)
    losses: dict[str, int] = field(default_factory=dict)
    frames: int = 0  # that the page's client has drawn
    recorded_mb: float = 0.0
    estimates: int = 0
    outcome: FaultOutcome = field(default_factory=lambda: FaultOutcome("soak"))
    replays: bool = False


class WalkPorts:
    """The ports as `live` uses them: the walk's chunks up to a time, and a way to the board.

    Once a minute of the walk memory is measured, and a stray edge disturbs the board's SyncOut input.
    """

    names = (BOARD,)  # the MTx is set up already

    def __init__(self, walk: EndlessWalk, board: BoardProcess, tracker: Tracker, measured: Measured) -> None:
        self.urls: dict[str, str] = {}
        self.notices: deque[str] = deque()
        self._walk, self._board, self._tracker, self._measured = walk, board, tracker, measured

    def send(self, _port: str, sent: bytes) -> None:
        """To the board."""
        self._board.send(sent)

    def chunks(self) -> Iterator[Chunk]:
        """In order of arrival."""
        due_s, seconds = 0.0, self._measured.seconds
        for chunk in self._walk.chunks():
            self._board.trace.clear()
            if self._walk.t_s >= due_s:
                due_s += min(SAMPLE_S, seconds / 20.0)
                self._look()
                self._board.fault("glitch=left")  # an edge on D4 that is none of SyncOut's
            if self._walk.t_s >= seconds:
                return
            yield chunk

    def _look(self) -> None:
        t_s, status = self._walk.t_s, self._tracker.streams.reports.status
        self._measured.memory.append((t_s, resident_mb("self"), resident_mb(str(self._board.pid))))
        if status is not None:
            self._measured.clock.append((t_s, status.ticks))


def resident_mb(process: str) -> float:
    """Resident memory of a process [proc(5)]."""
    pages = int(Path(f"/proc/{process}/statm").read_text().split()[1])
    return pages * 4096 / 1e6


def run(seconds: float, folder: Path, wrap: int, before_s: float = BEFORE_WRAP_S) -> Measured:
    """Walk for `seconds`, simulated; the board's clock starts `before_s` before it reaches `wrap`. Files go into `folder`."""
    plan, measured, start = load_plan(PLAN), Measured(seconds), wrap - round(before_s * TICKS_PER_S)
    elf = late_firmware(start, folder.resolve() / "firmware")
    board = BoardProcess([TWIN[0], "--elf", str(elf), "--seed", str(SEED)])
    walk = EndlessWalk(plan, SEED, board)
    tracker = Tracker(plan, walk.start, seed=SEED)
    output = OutputOptions(folder, terminal=False, page=Address(port=0))
    began = time.perf_counter()
    with ExitStack() as watched, ExitStack() as stack:
        stack.callback(board.close)
        session = Session(tracker, "echostep soak (simulated)", "live", output)
        session.prepare()
        stack.enter_context(session)
        assert session.page
        client = subprocess.Popen([sys.executable, "-c", CLIENT, session.page.url], stdout=subprocess.PIPE, text=True)
        watched.callback(client.kill)
        session.page.wait_for_page()
        metadata = run_metadata(plan, walk.start, SEED, "soak", source=SIMULATED) | clock_metadata()
        with start_recording(folder / "walk.mcap", metadata) as recorder:
            board.send(encode(m.Identify(), 0))
            ports = cast("SerialPorts", WalkPorts(walk, board, tracker, measured))
            session.track(portions_of(_recorded_chunks(ports, recorder, 100.0, None, session), PORTION), None, recorder)
        session.finish("soak")
        stack.close()  # the page's client ends with the page
        measured.frames = int(client.communicate()[0] or 0)
        measured.losses = losses(tracker, recorder)
    measured.wall_s = time.perf_counter() - began
    measured.recorded_mb = (folder / "walk.mcap").stat().st_size / 1e6
    t_s, xy_m, sure = columns(session.estimates)
    measured.estimates = len(t_s)
    judge_estimates(measured.outcome, (t_s - start / TICKS_PER_S) % (1e-3 * walk.length_ms), xy_m, sure, walk.truth)
    measured.replays = replays(folder)
    return measured


def losses(tracker: Tracker, recorder: Recorder) -> dict[str, int]:
    """Everything that counts a loss, of board, MTx, host and recorder, by name."""
    streams = tracker.streams
    status = streams.reports.status._asdict() if streams.reports.status else {}
    counts = {f"board: {name}": count for name, count in status.items() if "dropped" in name}
    counts |= {"board: frames lost": streams.board.lost, "board: frames rejected": streams.board.rejected}
    counts |= {f"MTx: {name}": count for name, count in asdict(streams.mtx).items() if name != "good"}
    return counts | {"recorder: chunks": recorder.lost_chunks, "recorder: derived": recorder.skipped_messages}


def replays(folder: Path) -> bool:
    """Whether a replay of the recording gives the live track, byte for byte."""
    command = [sys.executable, "-m", "echostep", "replay", str(folder / "walk.mcap"), "--plan", str(PLAN)]
    subprocess.run([*command, "--headless", "--out", str(folder / "again")], check=True, stdout=subprocess.DEVNULL)
    return (folder / "again/track.csv").read_bytes() == (folder / "track.csv").read_bytes()


def memory(name: str, t_s: Floats, mb: Floats, most_mb_h: float) -> Figure:
    """Growth of the memory by a straight line."""
    growth = float(np.polyfit(t_s / 3600.0, mb, 1)[0])
    text = f"{mb[0]:.1f} MB after {t_s[0] / 60:.0f} min, {mb[-1]:.1f} MB at the end, {growth:+.2f} MB/h"
    return Figure(f"memory of the {name}", text, f"<= {most_mb_h:g} MB/h", growth <= most_mb_h)


def wraps(clock: Sequence[tuple[float, int]]) -> Figure:
    """Of the board's clock: as its ticks show them, and as many as the time after the first look makes."""
    (first_s, first), (last_s, _) = clock[0], clock[-1]
    seen = sum(after < before for (_, before), (_, after) in pairwise(clock))
    due = (first + round((last_s - first_s) * TICKS_PER_S)) // WRAP
    return Figure("wraps of the board's clock", f"{seen}", f"{due}", seen == due)


def figures(measured: Measured) -> list[Figure]:
    """What a day may cost, and what it did."""
    t_s, host, twin = np.array(measured.memory).T
    settled = t_s >= min(SETTLED_S, measured.seconds / 2.0)
    lost = {name: count for name, count in measured.losses.items() if count}
    speed, shown, outcome = measured.seconds / measured.wall_s, measured.seconds / FRAME_S, measured.outcome
    tracked = f"{measured.estimates}, {100 * outcome.tracking:.1f} % tracking"
    return [
        memory("host", t_s[settled], host[settled], HOST_MB_H),
        memory("twin", t_s[settled], twin[settled], TWIN_MB_H),
        wraps(measured.clock),
        Figure("lost or dropped, anywhere", str(lost or 0), "0", not lost),
        Figure("replay is the live track", "yes" if measured.replays else "no", "yes", measured.replays),
        Figure("estimates", tracked, "> 0", measured.estimates > 0),
        none(f"tracking and over {SURE_M:g} m off", outcome.wrongly_sure),
        Figure("worst error", f"{outcome.worst_m:.2f} m"),
        Figure("frames that a page drew", f"{measured.frames}", f">= {shown:.0f}", measured.frames >= shown),
        Figure("recording", f"{measured.recorded_mb:.0f} MB"),
        Figure("time", f"{measured.wall_s / 60:.1f} min, {speed:.0f} x real time"),
    ]


def main() -> int:
    asked = options(
        __doc__,
        hours=(8.0, "simulated"),
        out=(OUT / "soak", "folder"),
        wrap=(next(iter(WRAPS)), "of the board's clock, before which it starts: half, whole"),
    )
    asked.out.mkdir(parents=True, exist_ok=True)
    measured = run(3600.0 * asked.hours, asked.out, WRAPS[asked.wrap])
    return report(f"{asked.hours:g} simulated hours", figures(measured))


if __name__ == "__main__":
    sys.exit(main())
