# SPDX-License-Identifier: MIT
"""Public recordings of a walking foot, read from a folder laid out like ../shared/data, each with its own way to judge a track.

In: the folder. Out: `FootRecording`s, the names of sets that are not there, and of files that could not be read. Owns nothing. Every file of a kind
is taken, known or not; peers' figures are known for some.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from echostep.arrays import Floats
from echostep.foot.steps import Track
from echostep_studies.bench.recordings.foot_metrics import FootFigure, climb, closure, mocap, mocap_3d, outbound, survey
from echostep_studies.frame.recordings import Sets

G_M_S2 = 9.80665
MIRROR = np.array([1.0, -1.0])  # a frame with z down has y to the right
MIRROR_3D = np.array([1.0, -1.0, 1.0])  # these trials have y to the right and z up
OPENSHOE_TICK_S = 1.0 / 19_660_800  # of its sample counter
OPENSHOE_PERIOD = 78_720
OPENSHOE_FIELDS = 17


@dataclass(frozen=True, slots=True)
class FootRecording:
    """Samples `t_s` (n,), `accel` (n, 3) m/s2, `gyro` (n, 3) rad/s, `mag` (n, 3) of any unit or None.

    `judge` gives the figures of a track of these samples; `truth_m` (m, 2) at `truth_t_s` (m,) is the true path where it is known.
    """

    group: str
    name: str
    t_s: Floats
    accel: Floats
    gyro: Floats
    judge: Callable[[Track], list[FootFigure]]
    mag: Floats | None = None
    truth_t_s: Floats | None = None
    truth_m: Floats | None = None


def _mat(path: Path) -> dict[str, Any]:
    from scipy.io import loadmat

    return dict(loadmat(path))


def _vicon(path: Path) -> Iterator[FootRecording]:
    """Motion capture at every sample [Wagstaff et al. 2019]."""
    mat = _mat(path)
    t_s, imu, truth = mat["timestamps_all"].ravel(), mat["imu_data"], mat["gt"] * MIRROR
    at = np.minimum(mat["strideIndex"].ravel().astype(int) - 1, len(t_s) - 1)
    name = path.stem.removesuffix("_LLIO")
    judge = partial(mocap, t_s=t_s, truth_m=truth, at=at, peer=VICON_PEERS.get(name))
    yield FootRecording("vicon", name, t_s, imu[:, :3], imu[:, 3:], judge, None, t_s, truth)


def _vicon_more(path: Path) -> Iterator[FootRecording]:
    """More trials of the same feet with motion capture in three dimensions: hurried, running, shuffling."""
    mat = _mat(path)
    t_s, imu, truth = mat["ts"].ravel(), mat["imu"], mat["gt"] * MIRROR_3D
    judge = partial(mocap_3d, t_s=t_s, truth_m=truth)
    yield FootRecording("vicon_more", path.stem, t_s, imu[:, :3], imu[:, 3:], judge, None, t_s, truth[:, :2])


def hallway(path: Path) -> Iterator[FootRecording]:
    """Every footprint surveyed with a ruler."""
    mat = _mat(path)
    t_s, imu = mat["timestamps"].ravel(), mat["imu_data"]
    truth = mat["GCP_wcf"] if "GCP_wcf" in mat else mat["GCP"][:, :2] * MIRROR
    at = np.minimum(mat["strideIndex"].ravel().astype(int) - 1, len(t_s) - 1)
    name = path.stem.removeprefix("SensorConnectData_").removesuffix("_LLIO")
    judge = partial(survey, name=name, t_s=t_s[at], truth_m=truth, peer=HALLWAY_PEERS.get(name))
    mag = _hallway_mag(path.with_name(path.name.replace("_LLIO.mat", ".csv")), t_s)
    yield FootRecording("hallway", name, t_s, imu[:, :3], imu[:, 3:], judge, mag, t_s[at], truth)


def _hallway_mag(path: Path, t_s: Floats) -> Floats | None:
    """The magnetometer (n, 3) at these times from the CSV beside, in the axes of the MAT file."""
    if not path.exists():
        return None
    with path.open() as file:
        head = file.readline().split(",")
    places = [next(k for k, name in enumerate(head) if f"scaledMag{axis}" in name) for axis in "XYZ"]
    table = np.genfromtxt(path, delimiter=",", skip_header=1, usecols=(0, *places))
    return np.column_stack([np.interp(t_s, table[:, 0], column) for column in table[:, 1:].T])


def _openshoe(path: Path) -> Iterator[FootRecording]:
    """A closed loop [Nilsson et al. 2012]."""
    lines = [line.split() for line in path.read_text().splitlines() if line.strip().startswith("0x")]
    whole = [line for line in lines if len(line) == OPENSHOE_FIELDS]
    table, mag = np.array([line[1:8] for line in whole], float), np.array([line[14:17] for line in whole], float)
    ticks = np.diff(table[:, 6])
    ticks[(ticks < 0) | (ticks > 2 * OPENSHOE_PERIOD)] = OPENSHOE_PERIOD  # the counter restarts once
    t_s = np.concatenate([[0.0], np.cumsum(ticks)]) * OPENSHOE_TICK_S
    name = path.stem.removeprefix("Measurement_100521_")
    judge = partial(closure, peer=OPENSHOE_PEERS.get(name), height_peer=("openshoe", 0.58))
    yield FootRecording("openshoe", name, t_s, table[:, :3] * G_M_S2, table[:, 3:6], judge, mag)


def _xio(path: Path) -> Iterator[FootRecording]:
    """A walk back to its start."""
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    judge = partial(closure, peer=XIO_PEERS.get(path.stem), height_peer=None)
    yield FootRecording("xio", path.stem, table[:, 0], table[:, 4:7] * G_M_S2, np.radians(table[:, 1:4]), judge)


def _mtw(path: Path) -> Iterator[FootRecording]:
    """An Xsens at 100 Hz on either foot, 10 m out and back [Voisard et al. 2024]."""
    trial = json.loads(path.with_name(path.name.split("_")[0] + ".json").read_text())
    table = np.loadtxt(path, skiprows=2)
    t_s = np.arange(len(table)) / 100.0
    judge = partial(outbound, start_s=t_s[trial["TrialBoundaries"][0]], turn_s=t_s[trial["UTurnBoundaries"]])
    yield FootRecording("mtw", path.stem, t_s, table[:, 1:4], table[:, 4:7], judge, table[:, 7:10])


def _gaitmap(path: Path) -> Iterator[FootRecording]:
    """A walk on stairs, both feet."""
    table = np.genfromtxt(path, delimiter=",", skip_header=2)
    for k, side in enumerate(("left", "right")):
        imu = table[:, 1 + 6 * k : 7 + 6 * k]
        name = f"{path.stem.removeprefix('imu_sample_healthy_')}, {side}"
        yield FootRecording("stairs", name, table[:, 0], imu[:, :3], np.radians(imu[:, 3:]), climb)


Peers = dict[str, tuple[str, float]]
VICON_PEERS: Peers = {
    "2017-11-22-11-22-03": ("pyshoe", 0.183),
    "2017-11-22-11-23-25": ("pyshoe", 0.085),
    "2017-11-22-11-26-05": ("pyshoe", 0.079),
    "2017-11-22-11-30-14": ("pyshoe", 0.094),
    "2017-11-27-11-12-18": ("pyshoe", 0.074),
    "2017-12-15-18-00-13": ("pyshoe", 0.059),
}
HALLWAY_PEERS: Peers = {"31": ("authors", 0.297), "33": ("authors", 0.631), "34": ("authors", 0.183)}
OPENSHOE_PEERS: Peers = {"2": ("openshoe", 0.67), "31": ("openshoe", 0.39), "44": ("openshoe", 0.05)}
XIO_PEERS: Peers = {"short_walk": ("pyshoe", 0.035)}
SETS: Sets[FootRecording] = (
    ("vicon", "vicon_pyshoe/*.mat", _vicon),
    ("vicon_more", "vicon_more/*.mat", _vicon_more),
    ("hallway", "gx5_gcp/*_LLIO.mat", hallway),
    ("openshoe", "openshoe/*.txt", _openshoe),
    ("xio", "xio_ngimu/*.csv", _xio),
    ("mtw", "xsens_mtw_voisard/*_?f.txt", _mtw),
    ("stairs", "gaitmap/*.csv", _gaitmap),
)
