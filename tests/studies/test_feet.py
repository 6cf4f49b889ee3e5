# SPDX-License-Identifier: MIT
"""`echostep evaluate feet`: the foot on real recordings against its targets, and what is said of folders that are not as they should be."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
import pytest

from command_line import echostep
from echostep.foot.ins import Noise
from echostep_studies.bench.recordings.feet import SETS, FootRecording
from echostep_studies.bench.recordings.foot_metrics import FootFigure, align, places, rmse
from echostep_studies.feet import leave_one_out
from echostep_studies.feet.leave_one_out import FigureRow
from echostep_studies.feet.study import LIVE, pace_rows, rows_of, track_of
from echostep_studies.frame.recordings import DATA, recordings_in
from foot.foot_walks import any_rotation
from needs_data import needs_data

needs_recordings = needs_data()


@pytest.fixture(scope="module")
def recordings() -> list[FootRecording]:
    return recordings_in(DATA, SETS)


@pytest.fixture(scope="module")
def rows(recordings: list[FootRecording]) -> list[FigureRow]:
    """Figures of all recordings."""
    return [row for recording in recordings for row in rows_of(recording, track_of(recording))]


def values(rows: list[FigureRow], group: str, metric: str) -> list[float]:
    """The figures of one metric, in the order of the recordings."""
    found = [row.value for row in rows if row.set == group and row.metric == metric]
    assert found
    return found


@needs_recordings
def test_motion_capture(rows: list[FigureRow]) -> None:
    assert median(values(rows, "vicon", "2D RMSE")) <= 0.055
    assert max(values(rows, "vicon", "2D RMSE")) <= 0.10
    assert max(values(rows, "vicon", "stride length MAE")) <= 0.029  # the best of the peers' six


@needs_recordings
def test_hurried_running_and_shuffling_feet(rows: list[FigureRow]) -> None:
    # 0.94 before a runner's drift was set back; 0.15 is wanted
    assert max(values(rows, "vicon_more", "height RMSE")) <= 0.35
    assert max(values(rows, "vicon_more", "2D RMSE")) <= 0.26  # 0.36 before; 0.15 is wanted


@needs_recordings
def test_surveyed_hallways(rows: list[FigureRow]) -> None:
    first, second, third = values(rows, "hallway", "2D RMSE at strides")
    assert first <= 0.35  # its last footprints are 0.7 m off every inertial track: 0.31 even for a perfect one
    assert second <= 0.45
    assert third <= 0.18
    assert max(values(rows, "hallway", "stride length MAE")) <= 0.04  # 31 in full, see there
    assert max(values(rows, "hallway", "stride length MAE")[1:]) <= 0.03
    assert values(rows, "hallway", "stride length MAE, first 29 footprints")[0] <= 0.03


@needs_recordings
def test_loops_and_walks(rows: list[FigureRow]) -> None:
    assert median(values(rows, "openshoe", "closure, horizontal")) <= 0.30
    assert max(map(abs, values(rows, "openshoe", "closure, height"))) <= 0.5
    assert values(rows, "xio", "closure, 3D")[0] <= 0.04
    assert median(values(rows, "mtw", "outbound, true 10.0")) == pytest.approx(10.0, rel=0.03)
    up_left, up_right = values(rows, "stairs", "climb, no truth")[2:]
    assert up_left == pytest.approx(up_right, abs=0.1)


@needs_recordings
def test_steps_are_told_within_50_ms_of_their_stance(recordings: list[FootRecording]) -> None:
    """Of one recording of each set, fed sample by sample."""
    live = pace_rows(list({recording.group: recording for recording in recordings}.values()))
    assert values(live, LIVE, "step told after its stance began, worst, s")[0] <= 0.05


def test_a_folder_without_recordings_is_named(tmp_path: Path) -> None:
    for folder in (tmp_path, tmp_path / "nowhere"):
        done = echostep("evaluate", "feet", "--data", folder)
        assert (done.returncode, done.stderr.count("\n")) == (2, 1), done.stderr
        assert str(folder) in done.stderr


@needs_recordings
def test_sets_and_files_that_cannot_be_read_are_named_and_skipped(tmp_path: Path) -> None:
    (tmp_path / "xio_ngimu").symlink_to(DATA / "xio_ngimu")
    (tmp_path / "vicon_pyshoe").mkdir()
    (tmp_path / "vicon_pyshoe" / "broken.mat").write_bytes(b"MATLAB 5.0 MAT-file" + bytes(200))
    done = echostep("evaluate", "feet", "--data", tmp_path, "--json", tmp_path / "feet.json", "--out", tmp_path)
    assert done.returncode == 0, done.stderr
    assert "broken.mat skipped" in done.stdout
    assert "hallway: skipped" in done.stdout
    written = json.loads((tmp_path / "feet.json").read_text())
    assert (written["study"], written["runs"]) == ("feet", 1)
    assert {row["set"] for row in written["rows"]} == {"xio", "live"}
    assert (tmp_path / "feet.png").stat().st_size > 10_000


def test_alignment_undoes_a_rigid_motion_but_no_mirror() -> None:
    rng = np.random.default_rng(1)
    path = rng.standard_normal((30, 2))
    turn = np.array([[0.6, -0.8], [0.8, 0.6]])
    assert align(path @ turn.T + [3.0, -2.0], path) == pytest.approx(path, abs=1e-12)
    assert rmse(path * [1.0, -1.0], path) > 0.5
    assert rmse(path * 2.0, path) > 0.5


def resampled(recording: FootRecording, rate_hz: float) -> FootRecording:
    """What the same sensor would give at a lower rate: means over longer periods."""
    t_s = recording.t_s
    edges = np.arange(t_s[0], t_s[-1], 1.0 / rate_hz)
    both = np.column_stack([recording.accel, recording.gyro])
    sums = np.vstack([np.zeros(6), np.cumsum(0.5 * (both[1:] + both[:-1]) * np.diff(t_s)[:, None], axis=0)])
    means = np.diff(np.column_stack([np.interp(edges, t_s, column) for column in sums.T]), axis=0) * rate_hz
    return replace(recording, t_s=0.5 * (edges[1:] + edges[:-1]), accel=means[:, :3], gyro=means[:, 3:])


def turned(recording: FootRecording, seed: int) -> FootRecording:
    turn = any_rotation(np.random.default_rng(seed))
    return replace(recording, accel=recording.accel @ turn.T, gyro=recording.gyro @ turn.T)


def mirrored(recording: FootRecording) -> FootRecording:
    """The other foot of a mirror image."""
    assert recording.truth_m is not None
    image = replace(recording, accel=recording.accel * [1, -1, 1], gyro=recording.gyro * [-1, 1, -1])
    return replace(image, truth_m=recording.truth_m * [1, -1])


def later(recording: FootRecording, cut_s: float) -> FootRecording:
    """Switched on in the middle of the walk."""
    kept = recording.t_s >= recording.t_s[0] + cut_s
    return replace(recording, t_s=recording.t_s[kept], accel=recording.accel[kept], gyro=recording.gyro[kept])


def thinned(recording: FootRecording) -> FootRecording:
    kept = np.random.default_rng(1).random(len(recording.t_s)) > 0.2
    return replace(recording, t_s=recording.t_s[kept], accel=recording.accel[kept], gyro=recording.gyro[kept])


def noisier(recording: FootRecording) -> FootRecording:
    """With the noise and the biases of an MTx of its own."""
    rng, n = np.random.default_rng(2), len(recording.t_s)
    accel = recording.accel + 0.03 * rng.standard_normal((n, 3)) + 0.03 * rng.standard_normal(3)
    gyro = recording.gyro + 0.01 * rng.standard_normal((n, 3)) + 0.003 * rng.standard_normal(3)
    return replace(recording, accel=accel, gyro=gyro)


@needs_recordings
@pytest.mark.parametrize(
    ("vary", "worst"),
    [
        (lambda r: turned(r, 1), 0.10),
        (lambda r: resampled(r, 50.0), 0.10),
        (lambda r: resampled(r, 125.0), 0.10),
        (mirrored, 0.10),
        (noisier, 0.11),
        (thinned, 0.13),
        (lambda r: later(r, 10.0), 0.10),
    ],
)
def test_motion_capture_holds_under_what_other_recordings_may_bring(
    recordings: list[FootRecording], vary: Callable[[FootRecording], FootRecording], worst: float
) -> None:
    errors = []
    for recording in recordings:
        if recording.group != "vicon":
            continue
        varied = vary(recording)
        track = track_of(varied)
        assert varied.truth_m is not None
        assert varied.truth_t_s is not None
        seen = varied.truth_t_s >= track.t_s[np.argmax(track.stance)]
        errors.append(rmse(places(track, varied.truth_t_s[seen]), varied.truth_m[seen]))
    assert len(errors) >= 6
    assert max(errors) <= worst
    assert median(errors) <= 0.07


def test_a_set_that_is_left_out_has_no_say_in_the_choice(monkeypatch: pytest.MonkeyPatch) -> None:
    """Three made-up sets, each with its own best lever; the choice for one is what the other two agree on."""
    monkeypatch.setattr(leave_one_out, "CONSTANTS", ("lever_m",))
    best = {"a": 0.5, "b": 2.0, "c": 2.0}

    def recording(group: str) -> FootRecording:
        def judge(track: Any) -> list[FootFigure]:
            return [FootFigure("error", 0.01 + abs(math.log(track / Noise().lever_m / best[group])))]

        empty = np.empty((0, 3))
        return FootRecording(group, "1", empty[:, 0], empty, empty, judge)

    def track_of(_: FootRecording, noise: Noise | None) -> Any:
        return (noise or Noise()).lever_m

    chosen = leave_one_out.leave_one_out([recording(group) for group in best], track_of)
    assert set(chosen) == set(best)
    assert chosen["a"].lever_m == 2.0 * Noise().lever_m  # its own best is the half
    row = FigureRow(set="a", recording="1", metric="error", value=1.0, distance_m=None, peer=None, peer_name=None)
    (beside,) = leave_one_out.with_left_out([row], {"a": [replace(row, value=2.0)]})
    assert beside.left_out == 2.0
