"""`echostep foot`: a recorded IMU in, a track out; wrong input is named, never tracked."""

from __future__ import annotations

import csv
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from echostep.errors import EchostepError
from echostep.imu import load_imu
from echostep.simulation.mtx import feelings
from echostep.simulation.walker import Person, walk
from foot_walks import data_folder

HEADER = "t_s,ax,ay,az,gx,gy,gz"


@pytest.fixture(scope="module")
def table() -> np.ndarray:
    """A simulated foot that walks 12 m out and 5 m to the side, 100 Hz."""
    found = walk([(0.0, 0.0), (12.0, 0.0), (12.0, 5.0)], Person(), np.random.default_rng(1))
    force, rate = feelings(found)
    mean = np.column_stack([force, rate])[: len(force) // 10 * 10].reshape(-1, 10, 6).mean(1)
    return np.column_stack([np.arange(len(mean)) / 100.0, mean])


def write(folder: Path, table: np.ndarray, header: str = HEADER) -> Path:
    path = folder / "imu.csv"
    np.savetxt(path, table, delimiter=",", header=header, comments="", fmt="%.7g")
    return path


def run(path: Path, *options: object) -> subprocess.CompletedProcess[str]:
    command = [
        sys.executable,
        "-m",
        "echostep",
        "foot",
        str(path),
        "--out",
        str(path.with_name("track.csv")),
        *map(str, options),
    ]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)


def test_a_walk_is_tracked_and_drawn(tmp_path: Path, table: np.ndarray) -> None:
    done = run(write(tmp_path, table), "--plot")
    assert done.returncode == 0, done.stderr
    rows = list(csv.DictReader((tmp_path / "track.csv").read_text().splitlines()))
    assert len(rows) == len(table)
    assert set(rows[0]) == {"t_s", "x", "y", "z", "heading_rad", "stance"}
    end = np.hypot(float(rows[-1]["x"]), float(rows[-1]["y"]))
    assert end == pytest.approx(13.0, rel=0.03)
    assert abs(float(rows[-1]["z"])) < 0.1
    assert (tmp_path / "track.png").stat().st_size > 10_000
    assert "steps" in done.stdout


@pytest.mark.parametrize("mounting", [(1, 0, 2), (2, 1, 0), (0, 2, 1)])
def test_any_mounting_gives_the_same_way(tmp_path: Path, table: np.ndarray, mounting: tuple[int, int, int]) -> None:
    turn = np.eye(3)[list(mounting)]
    turn[0] *= np.linalg.det(turn)
    turned = np.column_stack([table[:, 0], table[:, 1:4] @ turn.T, table[:, 4:7] @ turn.T])
    assert run(write(tmp_path, turned)).returncode == 0
    rows = list(csv.DictReader((tmp_path / "track.csv").read_text().splitlines()))
    assert np.hypot(float(rows[-1]["x"]), float(rows[-1]["y"])) == pytest.approx(13.0, rel=0.03)


def test_missing_and_broken_rows_are_counted(tmp_path: Path, table: np.ndarray) -> None:
    rng = np.random.default_rng(2)
    broken = table[rng.random(len(table)) > 0.2].copy()
    broken[rng.random(len(broken)) < 0.01, 2] = np.nan
    done = run(write(tmp_path, broken))
    assert done.returncode == 0, done.stderr
    rows = list(csv.DictReader((tmp_path / "track.csv").read_text().splitlines()))
    assert np.hypot(float(rows[-1]["x"]), float(rows[-1]["y"])) == pytest.approx(13.0, rel=0.1)


@pytest.mark.parametrize(
    ("spoil", "named"),
    [
        (lambda t: np.column_stack([t[:, 0], t[:, 1:4] / 9.80665, t[:, 4:]]), "look like g"),
        (lambda t: np.column_stack([t[:, 0], t[:, 1:4] * 100, t[:, 4:]]), "gravity is 9.8"),
        (lambda t: np.column_stack([t[:, :4], np.degrees(t[:, 4:])]), "deg/s"),
        (lambda t: np.column_stack([t[:, 0] * 1000, t[:, 1:]]), "in seconds"),
        (lambda t: np.column_stack([t[:, 0], t[:, 1:5], 0 * t[:, 5], t[:, 6]]), "gy is constant"),
        (lambda t: np.random.default_rng(3).permutation(t), "shuffled"),
        (lambda t: np.where(np.random.default_rng(4).random(t.shape) < 0.3, np.nan, t), "no number"),
        (lambda t: t[:1], "no samples"),
    ],
)
def test_wrong_input_is_named(tmp_path: Path, table: np.ndarray, spoil: object, named: str) -> None:
    assert callable(spoil)
    done = run(write(tmp_path, spoil(table)))
    assert (done.returncode, done.stderr.count("\n")) == (2, 1), done.stderr
    assert named in done.stderr
    assert "imu.csv" in done.stderr
    assert not (tmp_path / "track.csv").exists()


@pytest.mark.parametrize("content", ["", "a,b,c\n1,2,3\n", "\x00\x01\x02", HEADER + "\n", HEADER + "\nx,y\n"])
def test_what_is_no_table_is_named(tmp_path: Path, content: str) -> None:
    (tmp_path / "x.csv").write_text(content)
    with pytest.raises(EchostepError, match=r"x\.csv"):
        load_imu(tmp_path / "x.csv")


@pytest.mark.skipif(not data_folder().is_dir(), reason="skipped: no recordings (../shared/data or $ECHOSTEP_DATA)")
def test_a_real_walk_ends_where_it_began(tmp_path: Path) -> None:
    raw = np.loadtxt(data_folder() / "xio_ngimu/short_walk.csv", delimiter=",", skiprows=1)
    done = run(write(tmp_path, np.column_stack([raw[:, 0], raw[:, 4:7] * 9.80665, np.radians(raw[:, 1:4])])))
    assert done.returncode == 0, done.stderr
    rows = list(csv.DictReader((tmp_path / "track.csv").read_text().splitlines()))
    assert np.hypot(float(rows[-1]["x"]), float(rows[-1]["y"])) < 0.10
