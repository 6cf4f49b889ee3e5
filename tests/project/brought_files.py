# SPDX-License-Identifier: MIT
"""What a reader of the manual has: a drawing, files of sensors, recordings, a plan. Each function writes one such file."""

from __future__ import annotations

import atexit
import shutil
from functools import cache
from pathlib import Path
from tempfile import mkdtemp

import numpy as np
from ezdxf.filemanagement import new

from board_runs import ROOT
from command_line import echostep
from echostep.offline.imu_csv import Imu
from echostep.plan import load_plan
from foot.foot_walks import walking
from offline.imu_files import write
from scorecard.tapped_walks import tapped as record_tapped


@cache
def demo_folder() -> Path:
    """The results of the demo, run once for all pages."""
    folder = Path(mkdtemp())
    atexit.register(shutil.rmtree, folder)
    assert echostep("demo", "--headless", "--out", folder).returncode == 0
    return folder


def walk(path: Path) -> None:
    """A recording of the demo."""
    shutil.copyfile(demo_folder() / "walk.mcap", path)


def captured(path: Path) -> None:
    """The first seconds of one."""
    shutil.copyfile(ROOT / "tests/captures/walk.mcap", path)


def tapped(path: Path, corridor: Path) -> None:
    """A walk along the corridor of this plan, whose wearer taps the places."""
    record_tapped(path, load_plan(corridor))


def plan(path: Path) -> None:
    """The demo's plan."""
    shutil.copyfile(ROOT / "host/core/echostep/plans/demo.json", path)


def drawing(path: Path) -> None:
    """The walls of a room of 24 by 12 m (DXF)."""
    made = new(units=6)
    corners = [(0, 0), (24, 0), (24, 12), (0, 12)]
    for a, b in zip(corners, corners[1:] + corners[:1], strict=True):
        made.modelspace().add_line(a, b, {"layer": "A-WALL"})
    made.saveas(path)


def foot(path: Path) -> None:
    """A simulated walk of eight steps."""
    write(path, Imu(*walking(8)))


def foreign(path: Path) -> None:
    """The same by another program's names, in deg/s."""
    foot(path)
    table = np.loadtxt(path, delimiter=",", skiprows=1) * [1, 1, 1, 1, *[180.0 / np.pi] * 3]
    np.savetxt(path, table, delimiter=",", header="time,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z", comments="", fmt="%.9g")


def legs(path: Path) -> None:
    """Gyros of a leg that swings once a second for 20 s."""
    t_s = np.arange(0.0, 20.0, 0.01)
    swing = np.sin(2.0 * np.pi * t_s)
    rows = np.column_stack([t_s, 2.0 * swing, 3.0 * swing + np.sin(4.0 * np.pi * t_s)])
    np.savetxt(path, rows, delimiter=",", header="t_s,thigh_rad_s,shank_rad_s", comments="", fmt="%.6f")


def pressure(path: Path) -> None:
    """A minute of air on one floor."""
    t_s = np.arange(0.0, 60.0, 0.1)
    rows = np.column_stack([t_s, 101_325.0 + np.random.default_rng(1).normal(0.0, 2.0, len(t_s))])
    np.savetxt(path, rows, delimiter=",", header="t_s,pressure_pa", comments="", fmt="%.2f")


def true_path(path: Path) -> None:
    """A track or a true path."""
    path.write_text("t_s,x,y\n0,2,7.5\n0.4,2.5,7.5\n0.8,3,7.5\n")
