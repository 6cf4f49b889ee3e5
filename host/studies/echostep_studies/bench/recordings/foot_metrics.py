# SPDX-License-Identifier: MIT
"""Error of a foot's track against a recording's truth, in that data set's own metric.

In: a `Track` and the truth. Out: `FootFigure`s. Owns nothing. Tracks and truth share no origin and no yaw: they are aligned by the rigid
motion, without mirroring and without scale, that fits best over all points, which is how the peers' figures were taken.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from echostep.arrays import Bools, Floats, Ints, spans
from echostep.foot.steps import Track
from echostep_simulation.people.walker import Walk
from echostep_studies.frame.truth import at_times

FROZEN_SAMPLES = 5  # motion capture that repeats itself for longer has lost its markers
# Footprints of hallway 31 before two strides that contradict every inertial track by 0.3 and 0.6 m in length
SURVEYED_31 = 29


class FootFigure(NamedTuple):
    """A figure in metres, and the best that a peer, tuned for this set, has reached: (name, figure)."""

    metric: str
    value: float
    peer: tuple[str, float] | None = None


def align(track: Floats, truth: Floats) -> Floats:
    """Track (n, 2) after the rigid motion, without mirroring, that brings it nearest to truth (n, 2) [Kabsch 1976]."""
    a, b = track - track.mean(0), truth - truth.mean(0)
    u, _, vt = np.linalg.svd(a.T @ b)
    flip = np.diag([1.0, np.sign(np.linalg.det(u @ vt))])
    return np.asarray(a @ (u @ flip @ vt) + truth.mean(0))


def rmse(track: Floats, truth: Floats) -> float:
    """2D RMSE (m) of track (n, 2) after alignment to truth (n, 2)."""
    return float(np.sqrt(((align(track, truth) - truth) ** 2).sum(1).mean()))


def places(track: Track, t_s: Floats) -> Floats:
    """Horizontal positions (m, 2) at the times t_s (m,), straight in between samples."""
    later = np.concatenate([[True], np.diff(np.maximum.accumulate(track.t_s)) > 0.0])
    return at_times(t_s, track.t_s[later], track.position_m[later, :2])


def from_true_start(track: Track, walked: Walk, at: Ints) -> Floats:
    """Places (k, 2) on the map of the samples `at` (k,) of a track that begins at the true first place and heading of a simulated foot."""
    c, s = np.cos(walked.foot_rpy_rad[0, 2]), np.sin(walked.foot_rpy_rad[0, 2])
    return np.asarray(track.position_m[at, :2] @ np.array([[c, s], [-s, c]]) + walked.foot_m[0, :2])


def way(track: Track) -> float:
    """Length (m) of all steps, horizontal."""
    return float(sum(np.hypot(step.move_m[0], step.move_m[1]) for step in track.steps))


def mocap(
    track: Track, *, t_s: Floats, truth_m: Floats, at: NDArray[np.int_], peer: tuple[str, float] | None
) -> list[FootFigure]:
    """Against motion capture truth_m (n, 2) at every t_s (n,); strides end at the samples `at`."""
    xy, moving = places(track, t_s), ~_frozen(truth_m)
    return [
        FootFigure("2D RMSE", rmse(xy, truth_m), peer),
        FootFigure("2D RMSE where the truth moves", rmse(xy[moving], truth_m[moving])),
        FootFigure("stride length MAE", _stride_error(xy[at], truth_m[at]), peer and ("pyshoe", 0.029)),
    ]


def mocap_3d(track: Track, *, t_s: Floats, truth_m: Floats) -> list[FootFigure]:
    """Against motion capture truth_m (n, 3), z up, at every t_s (n,); heights are compared about their means."""
    error = track.position_m[:, 2] - truth_m[:, 2]
    xy, moving = places(track, t_s), ~_frozen(truth_m[:, :2])
    return [
        FootFigure("2D RMSE", rmse(xy, truth_m[:, :2])),
        FootFigure("2D RMSE where the truth moves", rmse(xy[moving], truth_m[moving, :2])),
        FootFigure("height RMSE", float(np.std(error))),
        FootFigure("height at the end", float(error[-1] - error[0])),
    ]


def survey(
    track: Track, *, name: str, t_s: Floats, truth_m: Floats, peer: tuple[str, float] | None
) -> list[FootFigure]:
    """Against surveyed footprints truth_m (n, 2), reached at t_s (n,)."""
    xy = places(track, t_s)
    figures = [
        FootFigure("2D RMSE at strides", rmse(xy, truth_m), peer),
        FootFigure("stride length MAE", _stride_error(xy, truth_m)),
    ]
    if name == "31":
        part = f", first {SURVEYED_31} footprints"
        xy, truth_m = xy[:SURVEYED_31], truth_m[:SURVEYED_31]
        figures.append(FootFigure("2D RMSE at strides" + part, rmse(xy, truth_m)))
        figures.append(FootFigure("stride length MAE" + part, _stride_error(xy, truth_m)))
    return figures


def closure(track: Track, *, peer: tuple[str, float] | None, height_peer: tuple[str, float] | None) -> list[FootFigure]:
    """The end is the beginning."""
    x, y, z = track.position_m[-1] - track.position_m[0]
    return [
        FootFigure("closure, 3D", float(np.linalg.norm([x, y, z])), peer if height_peer is None else None),
        FootFigure("closure, horizontal", float(np.hypot(x, y)), None if height_peer is None else peer),
        FootFigure("closure, height", float(z), height_peer),
    ]


def outbound(track: Track, *, start_s: float, turn_s: Floats) -> list[FootFigure]:
    """10 m out: how far out the turn is, halfway between the foot's places before and after it."""
    start, *turn = places(track, np.array([start_s, *turn_s]))
    return [FootFigure("outbound, true 10.0", float(np.hypot(*(np.array(turn) - start).T).mean()))]


def climb(track: Track) -> list[FootFigure]:
    """No truth but the other foot's."""
    return [FootFigure("climb, no truth", float(track.position_m[-1, 2] - track.position_m[0, 2]))]


def _frozen(truth: Floats) -> Bools:
    """Where motion capture (n, 2) has lost its markers and repeats itself for longer than 25 ms, before it jumps."""
    same = np.concatenate([[False], (np.diff(truth, axis=0) == 0.0).all(1)])
    frozen = np.zeros(len(truth), bool)
    for begin, end in spans(same):
        frozen[begin:end] = end - begin > FROZEN_SAMPLES
    return frozen


def _stride_error(track: Floats, truth: Floats) -> float:
    """Mean absolute error (m) of the stride lengths."""
    return float(np.abs(_lengths(track) - _lengths(truth)).mean())


def _lengths(points: Floats) -> Floats:
    """Distances (n - 1,) between consecutive points (n, 2)."""
    return np.asarray(np.hypot(*np.diff(points, axis=0).T))
