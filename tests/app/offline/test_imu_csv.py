# SPDX-License-Identifier: MIT
"""`echostep foot`: a recorded IMU in, a track out; wrong input is named, never tracked."""

from __future__ import annotations

import csv
import re
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from command_line import echostep
from echostep.errors import EchostepError
from echostep_app.offline.foot_files import load_foot
from echostep_simulation.devices.mtx import specific_force_and_rate
from echostep_simulation.people.walker import Person, walk

HEADER = "t_s,ax,ay,az,gx,gy,gz"
Spoil = Callable[[np.ndarray, np.random.Generator], np.ndarray]


@pytest.fixture(scope="module")
def table() -> np.ndarray:
    """A simulated foot that walks 12 m out and 5 m to the side, 100 Hz."""
    found = walk([(0.0, 0.0), (12.0, 0.0), (12.0, 5.0)], Person(), np.random.default_rng(1))
    force, rate = specific_force_and_rate(found)
    mean = np.column_stack([force, rate])[: len(force) // 10 * 10].reshape(-1, 10, 6).mean(1)
    return np.column_stack([np.arange(len(mean)) / 100.0, mean])


def gliding(t: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A foot that stands for 3 s, then glides at 0.06 m/s, speed and pitch trembling at 3 Hz."""
    wave, slope = ((t > 3.0) * each(6.0 * np.pi * t) for each in (np.sin, np.cos))
    samples = np.column_stack([1.13 * slope - 0.052 * wave, 0 * t, 9.81 + 0 * t, 0 * t, 0.1 * slope, 0 * t])
    return np.column_stack([t, samples + rng.standard_normal(samples.shape) * np.repeat([0.03, 0.006], 3)])


def rolling(t: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A wheelchair that gains 1 m/s in 2 s, and brakes as long before the end."""
    push = 0.5 * ((t > 3.0) & (t < 5.0)) - 0.5 * ((t > t[-1] - 5.0) & (t < t[-1] - 3.0))
    samples = np.column_stack([push, 0 * t, 9.81 + 0 * t, 0 * t, 0 * t, 0 * t])
    return np.column_stack([t, samples + rng.standard_normal(samples.shape) * np.repeat([0.03, 0.006], 3)])


def write(folder: Path, table: np.ndarray, header: str = HEADER) -> Path:
    path = folder / "imu.csv"
    np.savetxt(path, table, delimiter=",", header=header, comments="", fmt="%.13g")
    return path


def run(path: Path, *options: object) -> subprocess.CompletedProcess[str]:
    """The command on a file; the track lands beside it."""
    return echostep("foot", path, "--out", path.with_name("track.csv"), *options)


def end_m(track: Path) -> float:
    """How far the end is from the beginning."""
    rows = np.genfromtxt(track, delimiter=",", skip_header=1)
    return float(np.hypot(*(rows[-1, 1:3] - rows[0, 1:3])))


def test_a_walk_is_tracked_and_drawn(tmp_path: Path, table: np.ndarray) -> None:
    done = run(write(tmp_path, table), "--picture", str(tmp_path / "track.png"))
    assert done.returncode == 0, done.stderr
    rows = list(csv.DictReader((tmp_path / "track.csv").read_text().splitlines()))
    assert len(rows) == len(table)
    assert set(rows[0]) == {"t_s", "x", "y", "z", "heading_rad", "stance"}
    end = np.hypot(float(rows[-1]["x"]), float(rows[-1]["y"]))
    assert end == pytest.approx(13.0, rel=0.03)
    assert abs(float(rows[-1]["z"])) < 0.1
    assert (tmp_path / "track.png").stat().st_size > 10_000
    assert "steps" in done.stdout


@pytest.mark.parametrize(("spoil", "note"), [
    (lambda t, r: t[r.random(len(t)) > 0.2], "% of the samples are missing"),
    (lambda t, _r: t[(t[:, 0] % 5.0) > 0.5], "gaps"),
    (lambda t, r: np.repeat(t, 1 + (r.random(len(t)) < 0.3), axis=0), "repeat the time before"),
    (lambda t, r: r.permutation(t), "sorted by it"),
    (lambda t, r: np.where((r.random(len(t)) < 0.05)[:, None], np.array([1.0] + 6 * [np.nan]) * t, t), "without a number"),
    (lambda t, _r: np.column_stack([t[:, :4], np.clip(t[:, 4:], -4.5, 4.5)]), "is cut off at 4.5"),
    (lambda t, _r: np.column_stack([t[:, 0], np.clip(t[:, 1:4], -25.0, 25.0), t[:, 4:]]), "is cut off at"),
    (lambda t, _r: t * [1, 1, -1, -1, 1, -1, -1], "steps"),  # upside down
    (lambda t, _r: t[:, [0, 2, 3, 1, 5, 6, 4]], "steps"),  # on its side
    (lambda t, _r: t[150:], "steps"),
])  # fmt: skip
def test_what_can_be_mended_is_said_and_the_track_is_right_or_known_to_be_less_certain(
    tmp_path: Path, table: np.ndarray, spoil: Spoil, note: str
) -> None:
    done = run(write(tmp_path, spoil(table, np.random.default_rng(2))))
    assert done.returncode == 0, done.stderr
    assert note in done.stdout
    (known_m,) = re.findall(r"known to ([0-9.]+) m", done.stdout)
    assert abs(end_m(tmp_path / "track.csv") - 13.0) < max(3.0 * float(known_m), 0.4)


@pytest.mark.parametrize(("spoil", "named"), [
    (lambda t, _r: np.column_stack([t[:, 0], t[:, 1:4] * 100, t[:, 4:]]), "gravity is 9.8"),
    (lambda t, _r: t - (t[:, :1] > 7.005) * [7.005, 0, 0, 0, 0, 0, 0], "begins anew"),
    (lambda t, _r: t - (t[:, :1] > 7.005) * [60, 0, 0, 0, 0, 0, 0], "begins anew"),
    (lambda t, _r: np.round(t - (t[:, :1] > 7.005) * [7.01, 0, 0, 0, 0, 0, 0], 6), "begins anew"),
    (lambda t, _r: np.column_stack([t[:, 0] / 20, t[:, 1:]]), "average them down"),
    (lambda t, _r: np.column_stack([t[:, 0] / 1000, t[:, 1:]]), "are these seconds, not milliseconds"),
    (lambda t, _r: np.column_stack([t[:, 0], t[:, 1:5], 0 * t[:, 5], t[:, 6]]), "gy is constant"),
    (lambda t, _r: np.column_stack([t[:, :5], np.where(t[:, 0] > 6, 1.0, t[:, 5]), t[:, 6]]), "gy does not change"),
    (lambda t, _r: np.column_stack([0 * t[:, 0], t[:, 1:]]), "does not advance"),
    (lambda t, r: np.where(r.random(t.shape) < 0.3, np.nan, t), "no number"),
    (lambda t, _r: np.column_stack([np.tile(t[:300, 0], 9)[: len(t)], t[:, 1:]]), "t_s"),
    (lambda t, r: r.standard_normal(t.shape) * [0, 6, 6, 6, 3, 3, 3] + t * [1, 0, 0, 0, 0, 0, 0], "never still in these"),
    (lambda t, r: gliding(t[:, 0], r), "never still: it seems to stand"),
    (lambda t, r: rolling(t[:, 0], r), "s, yet the sensor moved, as on wheels"),
    (lambda t, _r: t * [1, 1, 1, 1, 1, -1, 1], "are the units"),  # left-handed
    (lambda t, _r: np.column_stack([t[:, :4], np.radians(t[:, 4:])]), "are the units"),  # converted twice
    (lambda t, _r: t[:, [0, 1, 2, 3, 5, 4, 6]], "are the units"),  # gx and gy swapped
    (lambda t, _r: t[:1], "no samples"),
])  # fmt: skip
def test_wrong_input_is_named(tmp_path: Path, table: np.ndarray, spoil: Spoil, named: str) -> None:
    done = run(write(tmp_path, spoil(table, np.random.default_rng(4))))
    assert (done.returncode, done.stderr.count("\n")) == (2, 1), done.stderr + done.stdout
    assert named in done.stderr
    assert "imu.csv" in done.stderr
    assert not (tmp_path / "track.csv").exists()


@pytest.mark.parametrize(
    "garbage", [b"\x00" * 4096, bytes(range(256)) * 16, b"spam,eggs,ham\n" * 300, b"1,2,3,4,5,6,7\n" * 300]
)
def test_a_gigabyte_of_garbage_ends_at_once_and_takes_no_memory(tmp_path: Path, garbage: bytes) -> None:
    """64 MB stand for it: what is read of them is bounded, so 1 GB takes no longer."""
    path = tmp_path / "imu.csv"
    for head in (b"", HEADER.encode() + b"\n"):
        with path.open("wb") as file:
            file.write(head)
            for _ in range((64 << 20) // (len(garbage) * 64)):
                file.write(garbage * 64)
        if head and garbage.startswith(b"1,2"):
            path.write_bytes(path.read_bytes()[: 1 << 20])  # these are rows: reading them takes what it takes
        began = time.process_time()
        with pytest.raises(EchostepError, match=r"imu\.csv"):
            load_foot(path)
        assert time.process_time() - began < 20.0
