# SPDX-License-Identifier: MIT
"""Files of strangers with their right results: what one file's path does, its neighbours' do, too."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from command_line import echostep
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


@pytest.mark.parametrize(
    ("write", "says"), [(held, "99 rows repeat the one before them: taken as missing"), (clocked, "12 steps")]
)
def test_held_rows_are_missing_and_a_clock_tells_the_time(
    write: Callable[[Path], None], says: str, tmp_path: Path
) -> None:
    write(tmp_path / "imu.txt")
    assert says in (said := echostep("foot", "imu.txt", cwd=tmp_path, ends=0)).stderr + said.stdout


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
