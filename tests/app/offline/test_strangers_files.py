# SPDX-License-Identifier: MIT
"""Files of strangers with their right results: what one file's path does, its neighbours' do, too."""

from __future__ import annotations

import errno
import os
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from command_line import echostep
from echostep.errors import words_of
from echostep.offline.imu_csv import COLUMNS
from foot.foot_walks import walking
from needs_data import data_or_skip


def held(path: Path) -> None:
    """Twelve steps, a second of them held."""
    t, accel, gyro = walking(12, 100)
    rows = np.column_stack([t, accel, gyro])
    rows[600:700, 1:] = rows[600, 1:]
    np.savetxt(path, rows, delimiter=",", header=",".join(COLUMNS), comments="")


def clocked(path: Path) -> None:
    """The same as MT Manager writes it, with a clock of 0.1 ms that wraps and no rate."""
    t, accel, gyro = walking(12, 100)
    clock = (np.rint(t * 1e4).astype(np.int64) + (1 << 32) - 30_000) % (1 << 32)
    axes = [f"{what}_{axis}" for what in ("Acc", "Gyr") for axis in "XYZ"]
    rows = [
        f"{k}\t{c}\t" + "\t".join(f"{v:.6f}" for v in (*a, *g))
        for k, (c, a, g) in enumerate(zip(clock, accel, gyro, strict=True))
    ]
    path.write_text(
        "\n".join(["// Firmware Version: 4.0.2", "\t".join(["PacketCounter", "SampleTimeFine", *axes]), *rows])
    )


def filled(rows: np.ndarray) -> np.ndarray:
    """Thirty rows without a sample: zeros, and -9999."""
    rows[150:-150:50, 1:] = np.where(np.arange(len(rows[150:-150:50]))[:, None] % 2, 0.0, -9999.0)
    return rows


def stamped(rows: np.ndarray) -> np.ndarray:
    """Ten single stamps that are late, or early, by a second, and not by whole periods."""
    rows[300:1300:100, 0] += np.where(np.arange(10) % 2, 1.004, -1.004)
    return rows


def dot(rows: np.ndarray) -> np.ndarray:
    """Movella DOT's, without the lines above the names; its microseconds wrap."""
    clock = (np.round(1e6 * rows[:, 0]) + (1 << 32) - 5e6) % (1 << 32)
    return np.column_stack([clock, rows[:, 1:4], np.degrees(rows[:, 4:])])


OURS, DOT = (
    ",".join(COLUMNS),
    "SampleTimeFine," + ",".join(f"{what}_{axis}" for what in ("Acc", "Gyr") for axis in "XYZ"),
)


@pytest.mark.parametrize(("spoil", "names", "form", "says"), [
    (filled, OURS, "%.9g", r"2\d rows without a number in some column: skipped"),
    (stamped, OURS, "%.9g", r"10 times are out of line with their neighbours': skipped"),
    (lambda rows: np.column_stack([1e-6 * dot(rows)[:, 0], rows[:, 1:]]), OURS, "%.9f", "12 steps"),
    (dot, DOT, "%.12g", "read as an export of Movella DOT"),
    (lambda rows: rows, OURS, '"%.6f"', "12 steps"),
])  # fmt: skip
def test_what_other_loggers_write_is_the_same_walk(
    spoil: Callable[[np.ndarray], np.ndarray], names: str, form: str, says: str, tmp_path: Path
) -> None:
    """A cell in quotes has a decimal comma."""
    rows = spoil(np.column_stack(walking(12, 100)))
    np.savetxt(tmp_path / "imu.csv", rows, form, ",", header=names, comments="")
    text = (tmp_path / "imu.csv").read_text()
    (tmp_path / "imu.csv").write_text(text.replace(".", ",") if '"' in text else text)
    said = echostep("foot", "imu.csv", cwd=tmp_path, ends=0).stdout
    assert re.search(says, said), said
    assert "12 steps, 15.6" in said


@pytest.mark.parametrize(
    ("write", "says"), [(held, "99 rows repeat the one before them: taken as missing"), (clocked, "12 steps")]
)
def test_held_rows_are_missing_and_a_clock_tells_the_time(
    write: Callable[[Path], None], says: str, tmp_path: Path
) -> None:
    write(tmp_path / "imu.txt")
    assert says in (said := echostep("foot", "imu.txt", cwd=tmp_path, ends=0)).stderr + said.stdout


@pytest.mark.parametrize("command", ["foot", "legs", "plan import", "plan check", "replay", "info"])
@pytest.mark.parametrize("name", ["pipe", "-"])
def test_a_pipe_is_named_before_it_is_waited_for(command: str, name: str, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    said = echostep(*command.split(), name, cwd=tmp_path, ends=2).stderr
    assert said == f"echostep: {name}: a pipe cannot be read twice: write it to a file, and give that\n"


def test_where_no_file_can_be_opened_no_package_is_named() -> None:
    error = OSError(errno.EMFILE, os.strerror(errno.EMFILE), "site-packages/numba/context.py")
    assert words_of(error) == "Too many open files: end what has them open, or allow more (ulimit -n 1024)"


@pytest.mark.process
@pytest.mark.parametrize(
    ("command", "name", "says"),
    [
        ("plan import", "names_row.dxf", "12 rooms"),
        ("plan import", "map_absolute.yaml", "m.pgm beside it was taken"),
        ("plan import", "exits_french.dxf", "left out: 2 LWPOLYLINE on ENTREE_SORTIE\nnote: the source"),
        ("plan import", "level_comma.osm", "level=2,3 is no number or range: write level=0;1"),
        ("foot", "mt_no_rate.txt", "20 steps, 28.00 m"),
        ("foot", "held_stride.csv", "99 rows repeat the one before them: taken as missing"),
    ],
)
def test_files_of_strangers_have_their_right_results(command: str, name: str, says: str, tmp_path: Path) -> None:
    path, out = data_or_skip("small") / "again" / name, "x.json" if command == "plan import" else "track"
    said = echostep(*command.split(), path, "--out", out, cwd=tmp_path, ends=0)
    assert says in said.stdout + said.stderr
