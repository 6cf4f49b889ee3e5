# SPDX-License-Identifier: MIT
"""Every reader of captures, recordings and tables says what it leaves out: a table of readers, damage, and the words that count it."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from board_runs import ROOT
from echostep.errors import EchostepError
from echostep.ports.chunks import Chunk
from echostep.recording import Decoder, read_capture
from echostep.xsens import MTDATA, encode_frame
from echostep_app.offline.floors.pressure_csv import load_pressures
from echostep_app.offline.foot_files import load_foot
from echostep_app.offline.leg_csv import load_legs
from echostep_app.recording.capture_summary import summary
from echostep_app.recording.recorder import Recorder
from echostep_app.recording.repair.contents import info
from foot.foot_walks import walking

CAPTURES = ROOT / "tests/captures"
BOARD, MTX = ((CAPTURES / f"{name}.bin").read_bytes() for name in ("board", "mtx"))
STRANGE = encode_frame(MTDATA, bytes(7))  # of a length that is no sample's


def decoded(folder: Path, content: bytes) -> str:
    """What `decode` says of a capture."""
    path, decoder = folder / "capture.bin", Decoder()
    path.write_bytes(content)
    list(read_capture(path, decoder))
    return "\n".join(summary(decoder))


def described(folder: Path, port: str, content: bytes) -> str:
    """What `info` says of a recording with bytes of one port."""
    path = folder / "walk.mcap"
    with Recorder(path, {}) as recorder:
        for k in range(0, len(content), 100):
            recorder.write(Chunk(port, k * 1_000_000, content[k : k + 100]))
    return "\n".join(info(path))


def table(folder: Path, names: str, rows: list[list[str]], first: dict[int, str]) -> Path:
    """A table; `first`: other text in place of these rows."""
    lines = [first.get(k, ",".join(row)) for k, row in enumerate(rows)]
    path = folder / "table.csv"
    path.write_text("\n".join([names, *lines]) + "\n")
    return path


def foot_rows() -> list[list[str]]:
    t_s, accel, gyro = walking(4, seed=3)
    return [[f"{v:.5f}" for v in (t, *a, *g)] for t, a, g in zip(t_s, accel, gyro, strict=True)]


def foot(folder: Path, first: dict[int, str], names: str = "t_s,ax,ay,az,gx,gy,gz", more: str = "") -> str:
    rows = [row + ([more] if more else []) for row in foot_rows()]
    return "\n".join(load_foot(table(folder, names, rows, first)).notes)


def leg(folder: Path, first: dict[int, str]) -> str:
    rows = [[f"{0.01 * k:.2f}", f"{k % 7 - 3}", f"{k % 11 - 5}", "0.1", f"{0.01 * k:.3f}"] for k in range(300)]
    return "\n".join(load_legs(table(folder, "t_s,thigh_rad_s,shank_rad_s,belt_rad_s,compass_rad", rows, first)).notes)


def air(folder: Path, first: dict[int, str]) -> str:
    rows = [[f"{0.1 * k:.1f}", f"{101_325 + k % 3}"] for k in range(300)]
    return "\n".join(load_pressures(table(folder, "t_s,pressure_pa", rows, first)).notes)


READERS: dict[str, tuple[Callable[[Path], str], str]] = {
    "decode, board: frames": (lambda f: decoded(f, BOARD[:5000] + b"\xff" * 300 + BOARD[5000:]), r"[2-9] were rejected \(1 of a wrong length"),
    "decode, board: the end": (lambda f: decoded(f, BOARD.rstrip(b"\0")), r"\d+ bytes at the end are no whole frame"),
    "info, board": (lambda f: described(f, "board", BOARD), r"board frames: \d+ good, 1 bad, 4 lost"),
    "info, MTx": (lambda f: described(f, "mtx", MTX + STRANGE), "refused: 1 of another length"),
    "foot: no number": (lambda f: foot(f, {3: "x,1,2,3,4,5,6"}), "^1 rows without a number in some column: skipped"),
    "foot: decimal commas": (lambda f: foot(f, {3: "0,03,1,2,3,4,5,6"}), "^1 rows without a number in some column: skipped"),
    "foot: half a magnetometer": (
        lambda f: foot(f, {}, "t_s,ax,ay,az,gx,gy,gz,mx", "1"), "mx without the other axes of the magnetometer: left out"),
    "legs: no number": (lambda f: leg(f, {3: "0.03,1,,0,0"}), "^1 rows without a number in some column: skipped"),
    "legs: times": (lambda f: leg(f, {3: "0.02,1,1,0,0"}), "1 rows are not later than the one before: skipped"),
    "legs: belt": (lambda f: leg(f, {3: "0.03,1,2,,0"}), "1 rows without a number in belt_rad_s: taken as no turning"),
    "floors: no number": (lambda f: air(f, {3: "0.3,x"}), r"^1 rows without a number in t_s or pressure_pa: skipped \(first: line 5\)"),
    "floors: no air": (lambda f: air(f, {3: "0.3,5"}), "1 rows with pressure_pa outside of"),
}  # fmt: skip


@pytest.mark.parametrize("reader", READERS)
def test_what_is_left_out_is_counted(tmp_path: Path, reader: str) -> None:
    read, words = READERS[reader]
    said = read(tmp_path)
    assert re.search(words, said, flags=re.M), said


def test_a_table_with_decimal_commas_between_commas_is_refused(tmp_path: Path) -> None:
    rows = [[cell.replace(".", ",") for cell in row] for row in foot_rows()]
    with pytest.raises(EchostepError, match="more cells than there are names"):
        load_foot(table(tmp_path, "t_s,ax,ay,az,gx,gy,gz", rows, {}))
