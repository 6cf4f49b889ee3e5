"""The foot on real recordings with truth: one setting for all of them, each data set's own metric, beside the peers' figures.

In: the folder of recordings ($ECHOSTEP_DATA or ../shared/data). Out: a table. Nothing is fitted to these files.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from echostep.foot import FootSettings, Step, Track, walk_track
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table
from scipy.io import loadmat

Floats = NDArray[np.float64]
G = 9.80665
DOWN = np.array([1.0, -1.0])  # these sets' truth has z down: y to the right of x


@dataclass(frozen=True)
class Row:
    """One figure: `value` in metres (or as the metric says), `peer` what others reached."""

    set: str
    recording: str
    metric: str
    value: float
    distance_m: float
    peer: str


def data_folder() -> Path:
    """Where the recordings are."""
    return Path(os.environ.get("ECHOSTEP_DATA", Path(__file__).resolve().parent.parent.parent / "shared" / "data"))


def align(track: Floats, truth: Floats) -> Floats:
    """Track (n, 2) after the rigid motion that brings it nearest to truth (n, 2) [Kabsch 1976]."""
    a, b = track - track.mean(0), truth - truth.mean(0)
    u, _, vt = np.linalg.svd(a.T @ b)
    flip = np.diag([1.0, np.sign(np.linalg.det(u @ vt))])
    return a @ (u @ flip @ vt) + truth.mean(0)


def rmse(a: Floats, b: Floats) -> float:
    return float(np.sqrt(((a - b) ** 2).sum(1).mean()))


def length(track: Track) -> float:
    return sum(math.hypot(e.move_m[0], e.move_m[1]) for e in track.events if isinstance(e, Step))


def vicon(folder: Path, settings: FootSettings) -> Iterator[Row]:
    peers = ("0.183", "0.085", "0.079", "0.094", "0.074", "0.059")
    for path, peer in zip(sorted((folder / "vicon_pyshoe").glob("*.mat")), peers, strict=True):
        mat = loadmat(path)
        imu, t = mat["imu_data"], mat["timestamps_all"].ravel()
        turn = np.diag([1.0, -1.0, -1.0])  # z is down in this set
        track = walk_track(t - t[0], imu[:, :3] @ turn, imu[:, 3:] @ turn, settings)
        truth = mat["gt"] * DOWN
        n = min(len(truth), len(track.position_m))
        value = rmse(align(track.position_m[:n, :2], truth[:n]), truth[:n])
        yield Row("vicon", path.stem[:19], "2D RMSE, aligned", value, length(track), peer)


def hallways(folder: Path, settings: FootSettings) -> Iterator[Row]:
    for name, peer in (("31", "0.578 / 0.297"), ("33", "0.591 / 0.631"), ("34", "0.210 / 0.183")):
        mat = loadmat(folder / f"gx5_gcp/SensorConnectData_{name}_LLIO.mat")
        imu, t = mat["imu_data"], mat["timestamps"].ravel()
        truth, at = mat["GCP"][:, :2] * DOWN, mat["strideIndex"].ravel().astype(int) - 1
        track = walk_track(t - t[0], imu[:, :3], imu[:, 3:], settings)
        here = track.position_m[np.minimum(at, len(imu) - 1), :2]
        n = min(len(here), len(truth))
        value = rmse(align(here[:n], truth[:n]), truth[:n])
        yield Row("hallway", name, "2D RMSE at strides, aligned", value, length(track), peer)
        stride = np.hypot(*np.diff(here[:n], axis=0).T) - np.hypot(*np.diff(truth[:n], axis=0).T)
        yield Row("hallway", name, "stride length MAE", float(np.abs(stride).mean()), length(track), "0.03")


def openshoe(folder: Path, settings: FootSettings) -> Iterator[Row]:
    for name, peer in (("2", "0.67"), ("31", "0.39"), ("44", "0.05")):
        rows = []
        for line in (folder / f"openshoe/Measurement_100521_{name}.txt").read_text().splitlines()[1:]:
            parts = line.split()
            if len(parts) > 12 and parts[0].startswith("0x"):
                rows.append([float(v) for v in parts[1:7]])
        table = np.array(rows)
        t = np.arange(len(table)) / 250.0
        track = walk_track(t, table[:, :3] * G, table[:, 3:6], settings)
        p = track.position_m
        closure = float(np.hypot(*(p[-1, :2] - p[0, :2])))
        yield Row("openshoe", name, "closure", closure, length(track), peer)
        yield Row("openshoe", name, "height", float(p[-1, 2] - p[0, 2]), length(track), "-0.6")


def xio(folder: Path, settings: FootSettings) -> Iterator[Row]:
    table = np.loadtxt(folder / "xio_ngimu/short_walk.csv", delimiter=",", skiprows=1)
    track = walk_track(table[:, 0], table[:, 4:7] * G, np.radians(table[:, 1:4]), settings)
    p = track.position_m
    yield Row("xio", "short walk", "closure", float(np.linalg.norm(p[-1] - p[0])), length(track), "0.082 / 0.035")


def mtw(folder: Path, settings: FootSettings) -> Iterator[Row]:
    for path in sorted((folder / "xsens_mtw_voisard").glob("*_?f.txt")):
        trial = json.loads(path.with_name(path.name[:3] + ".json").read_text())
        table = np.loadtxt(path, skiprows=2)
        track = walk_track(np.arange(len(table)) / 100.0, table[:, 1:4], table[:, 4:7], settings)
        start, turn = trial["TrialBoundaries"][0], trial["UTurnBoundaries"]
        p = track.position_m
        out = float(np.hypot(*(p[min(turn[0], len(p) - 1), :2] - p[max(start, 0), :2])))
        yield Row("mtw", path.stem, "outbound (10 m)", out, length(track), "10.0")


def rows(folder: Path, settings: FootSettings) -> list[Row]:
    """Every figure."""
    return [r for part in (vicon, hallways, openshoe, xio, mtw) for r in part(folder, settings)]


def main() -> None:
    folder = data_folder()
    if not folder.is_dir():
        raise SystemExit(f"skipped: no recordings in {folder}")
    table = Table("set", "recording", "metric", "value", "distance", "peer")
    for r in rows(folder, FootSettings()):
        table.add_row(r.set, r.recording, r.metric, f"{r.value:.3f}", f"{r.distance_m:.1f} m", r.peer)
    Console(width=110).print(table)


if __name__ == "__main__":
    main()
