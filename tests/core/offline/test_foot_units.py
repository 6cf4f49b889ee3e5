# SPDX-License-Identifier: MIT
"""One walk in the units, rates, clocks and spellings of other people's loggers: read alike, or asked about with the remedy."""

from __future__ import annotations

import re
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep.foot.steps import walk_track
from echostep.offline.imu_csv import load_imu
from echostep.plan import NO_PLAN
from echostep.ports.imu_samples import FEWEST_SAMPLES
from echostep.settings import Settings
from echostep.tracker import Tracker
from echostep_simulation.people.rolling_foot import MANNERS, course, samples

WALK = course(MANNERS["walking"], 20, np.random.default_rng(7))
T_S, ACCEL, GYRO = samples(WALK, 100, rng=np.random.default_rng(3))
NAMES = "t_s,ax,ay,az,gx,gy,gz"
GRAVITY = np.einsum("nji,j->ni", WALK.rotation[::10][: len(T_S)], np.array([0.0, 0.0, 9.81]))
Samples = tuple[Floats, Floats, Floats]


def text_of(columns: Samples) -> str:
    rows = (",".join(f"{v:.6f}" for v in row) for row in np.column_stack(columns).tolist())
    return "\n".join([NAMES, *rows]) + "\n"


@pytest.mark.parametrize(("spelled", "encoding"), [
    (str, "utf-8"),
    (lambda text: text.replace(",", ";").replace(".", ","), "utf-8-sig"),  # Excel in most of Europe
    (lambda text: text.replace(",", "\t").replace(".", ","), "utf-16"),  # Excel's "Unicode text"
    (lambda text: text.replace("\n", "\n\n").replace("ay", " ay "), "utf-8"),
    (lambda text: "\n".join(",".join([*line.split(",")[::-1], "7"]) for line in text.splitlines()), "utf-8"),
    (lambda text: text.replace("\n", "\r\n"), "utf-8"),
])  # fmt: skip
def test_spellings_are_read_alike(tmp_path: Path, spelled: Callable[[str], str], encoding: str) -> None:
    path = tmp_path / "foot.csv"
    path.write_text(spelled(text_of((T_S, ACCEL, GYRO))), encoding=encoding, newline="")
    imu = load_imu(path)
    assert np.allclose(imu.accel, ACCEL, atol=1e-5)
    assert np.allclose(imu.gyro, GYRO, atol=1e-5)
    assert imu.notes == ()


@pytest.mark.parametrize(("columns", "said"), [
    ((T_S, ACCEL / 9.81, GYRO), r"look like g \(at rest they are 1\.00\): multiply them by 9\.80665"),
    ((T_S, ACCEL, np.degrees(GYRO)), "in deg/s\\? multiply them by pi/180"),
    ((T_S, ACCEL, 0.2 * np.degrees(GYRO)), "in deg/s\\? multiply them by pi/180"),
    ((1e3 * T_S, ACCEL, GYRO), "is it in milliseconds\\? divide it by 1000"),
    ((1.7e18 + 1e9 * T_S, ACCEL, GYRO), "is it in nanoseconds\\? divide it by 1000000000"),
    (samples(WALK, 10, rng=np.random.default_rng(3)), "a foot needs 50 at least"),
    ((T_S, ACCEL - GRAVITY, GYRO), "gravity was removed"),
])  # fmt: skip
def test_other_units_are_asked_about_with_the_remedy(tmp_path: Path, columns: Samples, said: str) -> None:
    path = tmp_path / "foot.csv"
    path.write_text(text_of(columns))
    with pytest.raises(EchostepError, match=said):
        load_imu(path)
    if len(columns[0]) < FEWEST_SAMPLES:  # arrays of a moment may have no rest
        return
    for take in (walk_track, Tracker(NO_PLAN, None, Settings.of_imu(100.0)).feed_samples):
        with pytest.raises(EchostepError, match=said):
            take(*columns)


def test_arrays_in_reversed_order_are_refused() -> None:
    with pytest.raises(EchostepError, match="t_s goes back in 100 %"):
        walk_track(T_S[::-1], ACCEL, GYRO)


def test_a_clock_of_the_epoch_is_no_fault(tmp_path: Path) -> None:
    path = tmp_path / "foot.csv"
    rows = text_of((1.7e9 + T_S, ACCEL, GYRO))
    for text in (rows, re.sub(r"(?m)^1[\d.]+", lambda found: str(datetime.fromtimestamp(float(found[0]), UTC)), rows)):
        path.write_text(text)
        assert np.allclose(np.diff(load_imu(path).t_s), 0.01, atol=1e-4)
