# SPDX-License-Identifier: MIT
"""Make the small captures in this folder with the twin (real firmware, simulated sensors), and their golden decodes.

    .venv/bin/python tests/captures/make.py

board.bin: the board's port, with a failing ranger and lost bytes in the middle. mtx.bin: the MTx's port. walk.mcap: both, as recorded.
The *.jsonl files are what `echostep decode` makes of them; a change there is a change of behaviour, to be read in the diff.
"""

from __future__ import annotations

import json
import sys
from itertools import takewhile
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

from board_runs import ELF, ROOT, TWIN  # noqa: E402
from echostep.plan import load_plan  # noqa: E402
from echostep.ports.chunks import BOARD, Chunk  # noqa: E402
from echostep.recording import as_json, read_capture  # noqa: E402
from echostep_app.recording.recorder import Recorder  # noqa: E402
from echostep_simulation.devices.board import BoardProcess  # noqa: E402
from echostep_simulation.scenario import demo_scenario  # noqa: E402

SECONDS = 4.0
NAMES = ("board.bin", "mtx.bin", "walk.mcap")


def chunks() -> list[Chunk]:
    """The first seconds of the demo walk; the right ranger refuses to answer in the third."""
    board = BoardProcess([str(TWIN), "--elf", str(ELF)])
    scenario = demo_scenario(load_plan(ROOT / "host/core/echostep/plans/demo.json"), 1, board)
    found = []
    faults = {2.0: "srf_right=nack", 3.0: "srf_right=ok"}
    for chunk in takewhile(lambda c: c.t_arrival_ns < (1.0 + SECONDS) * 1e9, scenario.chunks()):
        for t_s in [t for t in faults if chunk.t_arrival_ns >= (1.0 + t) * 1e9]:
            board.fault(faults.pop(t_s))
        found.append(chunk)
    scenario.close()
    return found


def main() -> None:
    found = chunks()
    board = b"".join(c.data for c in found if c.port == BOARD)
    half = len(board) // 2
    (HERE / "board.bin").write_bytes(board[:half] + board[half + 40 :])
    (HERE / "mtx.bin").write_bytes(b"".join(c.data for c in found if c.port != BOARD))
    (HERE / "walk.mcap").unlink()
    with Recorder(HERE / "walk.mcap", {"note": "simulated walk, real firmware in the twin"}) as recorder:
        for chunk in found:
            recorder.write(chunk)
    for name in NAMES:
        lines = [json.dumps(as_json(message)) + "\n" for message in read_capture(HERE / name)]
        (HERE / name).with_suffix(".jsonl").write_text("".join(lines))


if __name__ == "__main__":
    main()
