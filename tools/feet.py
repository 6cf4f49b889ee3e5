"""The foot on real recordings with truth: one setting for all of them, each data set's own metric, beside the peers' figures.

In: the folder of recordings ($ECHOSTEP_DATA or ../shared/data). Out: a table. Nothing is fitted to these files: `echostep.foot` has one constant
for a person to set, the sensor's height above the floor, and it stays at its default here.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from time import perf_counter

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table
from scipy.io import loadmat

from echostep.foot import Track, walk_track

Floats = NDArray[np.float64]
G = 9.80665
MIRROR = np.array([1.0, -1.0])  # a frame with z down has y to the right
OPENSHOE_TICK_S = 1.0 / 19_660_800  # of its sample counter
OPENSHOE_PERIOD = 78_720


@dataclass(frozen=True, slots=True)
class Row:
    """One figure in metres; `peers` is what others reached on it, in words."""

    group: str
    recording: str
    metric: str
    value: float
    peers: str


def data_folder() -> Path:
    """Where the recordings are."""
    return Path(os.environ.get("ECHOSTEP_DATA", Path(__file__).resolve().parents[2] / "shared" / "data"))


def align(track: Floats, truth: Floats) -> Floats:
    """Track (n, 2) after the rigid motion, without mirroring, that brings it nearest to truth (n, 2) [Kabsch 1976]."""
    a, b = track - track.mean(0), truth - truth.mean(0)
    u, _, vt = np.linalg.svd(a.T @ b)
    flip = np.diag([1.0, np.sign(np.linalg.det(u @ vt))])
    return np.asarray(a @ (u @ flip @ vt) + truth.mean(0))


def rmse(track: Floats, truth: Floats) -> float:
    """2D RMSE (m) of track (n, 2) after alignment to truth (n, 2)."""
    return float(np.sqrt(((align(track, truth) - truth) ** 2).sum(1).mean()))


def lengths(points: Floats) -> Floats:
    """Distances (n - 1,) between consecutive points (n, 2)."""
    return np.asarray(np.hypot(*np.diff(points, axis=0).T))


def frozen(truth: Floats) -> NDArray[np.bool_]:
    """Where motion capture (n, 2) has lost its markers and repeats itself for longer than 25 ms, before it jumps."""
    same = np.concatenate([[False], (np.diff(truth, axis=0) == 0.0).all(1)])
    edges = np.flatnonzero(np.diff(np.concatenate([[0], same.astype(int), [0]])))
    found = np.zeros(len(truth), bool)
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        found[begin:end] = end - begin > 5
    return found


def vicon(folder: Path) -> Iterator[Row]:
    """Motion capture at every sample."""
    for path, peer in zip(
        sorted((folder / "vicon_pyshoe").glob("*.mat")),
        ("0.183", "0.085", "0.079", "0.094", "0.074", "0.059"),
        strict=True,
    ):
        mat = loadmat(path)
        track = walk_track(mat["timestamps_all"].ravel(), mat["imu_data"][:, :3], mat["imu_data"][:, 3:])
        xy, truth, at = track.position_m[:, :2] * MIRROR, mat["gt"], mat["strideIndex"].ravel() - 1
        seen = ~frozen(truth)
        yield Row("vicon", path.stem[:19], "2D RMSE, aligned", rmse(xy, truth), f"pyshoe {peer}")
        yield Row("vicon", path.stem[:19], "same, where the truth moves", rmse(xy[seen], truth[seen]), "")
        yield Row("vicon", path.stem[:19], "stride length MAE", stride_error(xy[at], truth[at]), "pyshoe 0.029-0.061")


def stride_error(track: Floats, truth: Floats) -> float:
    """Mean absolute error (m) of the stride lengths."""
    return float(np.abs(lengths(track) - lengths(truth)).mean())


def hallways(folder: Path) -> Iterator[Row]:
    """Every footprint surveyed with a ruler."""
    peers = {
        "31": "pyshoe 0.578, authors 0.297",
        "33": "pyshoe 0.591, authors 0.631",
        "34": "pyshoe 0.210, authors 0.183",
    }
    for name, peer in peers.items():
        mat = loadmat(folder / f"gx5_gcp/SensorConnectData_{name}_LLIO.mat")
        track = walk_track(mat["timestamps"].ravel(), mat["imu_data"][:, :3], mat["imu_data"][:, 3:])
        at, truth = mat["strideIndex"].ravel() - 1, mat["GCP_wcf"]
        xy = track.position_m[at, :2]
        yield Row("hallway", name, "2D RMSE at strides, aligned", rmse(xy, truth), peer)
        if name == "31":  # the survey's last strides contradict every inertial track by 0.3 and 0.6 m in length
            yield Row("hallway", name, "same, first 29 footprints", rmse(xy[:29], truth[:29]), "")
            xy, truth = xy[:29], truth[:29]
        yield Row("hallway", name, "stride length MAE", stride_error(xy, truth), "")


def openshoe(folder: Path) -> Iterator[Row]:
    """Closed loops of 77-79 m."""
    for name, peer in (("2", "0.67"), ("31", "0.39"), ("44", "0.05")):
        lines = (folder / f"openshoe/Measurement_100521_{name}.txt").read_text().splitlines()
        table = np.array([line.split()[1:8] for line in lines if line.strip().startswith("0x")], float)
        ticks = np.diff(table[:, 6])
        ticks[(ticks < 0) | (ticks > 2 * OPENSHOE_PERIOD)] = OPENSHOE_PERIOD  # the counter starts anew once
        t_s = np.concatenate([[0.0], np.cumsum(ticks)]) * OPENSHOE_TICK_S
        track = walk_track(t_s, table[:, :3] * G, table[:, 3:6])
        end = track.position_m[-1]
        yield Row("openshoe", name, "closure, horizontal", float(np.hypot(end[0], end[1])), f"openshoe {peer}")
        yield Row("openshoe", name, "closure, height", float(end[2]), "openshoe -0.58 to -0.71")
        yield Row("openshoe", name, "way", way(track), "77-79")


def way(track: Track) -> float:
    """Length (m) of all steps, horizontal."""
    return float(sum(np.hypot(step.move_m[0], step.move_m[1]) for step in track.steps))


def xio(folder: Path) -> Iterator[Row]:
    """A short walk back to its start."""
    table = np.loadtxt(folder / "xio_ngimu/short_walk.csv", delimiter=",", skiprows=1)
    track = walk_track(table[:, 0], table[:, 4:7] * G, np.radians(table[:, 1:4]))
    closure = float(np.linalg.norm(track.position_m[-1]))
    yield Row("xio", "short walk", "closure, 3D", closure, "xio 0.082, pyshoe 0.035")
    yield Row("xio", "short walk", "closure, horizontal", float(np.hypot(*track.position_m[-1, :2])), "")


def mtw(folder: Path) -> Iterator[Row]:
    """An Xsens at 100 Hz on either foot, 10 m out and back: how far out the turn is, halfway between the foot's places before and after it."""
    for path in sorted((folder / "xsens_mtw_voisard").glob("*_?f.txt")):
        trial = json.loads(path.with_name(path.name[:3] + ".json").read_text())
        table = np.loadtxt(path, skiprows=2)
        track = walk_track(np.arange(len(table)) / 100.0, table[:, 1:4], table[:, 4:7])
        away = np.hypot(*(track.position_m[:, :2] - track.position_m[trial["TrialBoundaries"][0], :2]).T)
        yield Row("mtw", path.stem, "outbound", float(away[trial["UTurnBoundaries"]].mean()), "true 10.0, loosely")


def rows(folder: Path) -> list[Row]:
    """Every figure."""
    return [row for part in (vicon, hallways, openshoe, xio, mtw) for row in part(folder)]


def medians(found: list[Row]) -> Iterator[Row]:
    """The median of each metric that has several recordings."""
    for group, metric in dict.fromkeys((row.group, row.metric) for row in found):
        same = [row for row in found if (row.group, row.metric) == (group, metric)]
        if len(same) > 1:
            yield Row(group, f"median of {len(same)}", metric, median(row.value for row in same), "")


def main() -> None:
    """Print the table."""
    folder = data_folder()
    if not folder.is_dir():
        raise SystemExit(f"skipped: no recordings in {folder}")
    began = perf_counter()
    found = rows(folder)
    table = Table("set", "recording", "metric", "m", "peers")
    for row in [*found, *medians(found)]:
        table.add_row(row.group, row.recording, row.metric, f"{row.value:.3f}", row.peers)
    console = Console(width=120)
    console.print(table)
    console.print(f"{perf_counter() - began:.1f} s, files and compilation included")


if __name__ == "__main__":
    main()
