# SPDX-License-Identifier: MIT
"""The foot on public recordings: headings, mountings, limits of a sensor, standing, legs that are no feet."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import scipy.io

from echostep.arrays import Floats
from echostep.foot.alignment import aligned
from echostep.foot.steps import Step, Track, walk_track
from echostep.offline.imu_checks import contradiction
from echostep_studies.bench.recordings.feet import SETS, FootRecording
from echostep_studies.feet.study import track_of
from echostep_studies.frame.recordings import DATA, read_sets, recordings_in
from foot import foot_walks as fw
from needs_data import needs_data


@pytest.mark.slow
@needs_data()
def test_on_the_hallways_headings_are_never_worse_than_without() -> None:
    """Stride headings against the survey's, with and without."""
    seen = 0
    for recording in read_sets(DATA, SETS)[0]:
        if recording.group != "hallway" or recording.mag is None:
            continue
        seen += 1
        assert recording.truth_m is not None
        assert recording.truth_t_s is not None
        plain = walk_track(recording.t_s, recording.accel, recording.gyro)
        fused = walk_track(recording.t_s, recording.accel, recording.gyro, mag=recording.mag)
        assert fused.compass[1] > 20
        true = np.arctan2(*np.diff(recording.truth_m, axis=0).T[::-1])
        errors = []
        for track in (plain, fused):
            at = np.searchsorted(recording.t_s, recording.truth_t_s)
            strides = np.diff(track.position_m[at, :2], axis=0)
            off = np.exp(1j * (np.arctan2(strides[:, 1], strides[:, 0]) - true))
            errors.append(float(np.abs(np.angle(off / off[:5].mean())).mean()))
        assert errors[1] <= errors[0] + 1e-9
    assert seen


@pytest.mark.slow
@needs_data()
def test_on_real_feet_the_toe_looks_where_they_walk() -> None:
    """Thirty feet, mounted as their owners liked, turned once more: long steps go within a toe-out angle of the toe's direction."""
    for k, recording in enumerate(read_sets(DATA, SETS)[0]):
        turn = fw.any_rotation(np.random.default_rng(k))
        track = aligned(walk_track(recording.t_s, recording.accel @ turn.T, recording.gyro @ turn.T))
        assert track.toe_known, recording.name
        before = [0.0, *(step.heading_rad for step in track.steps)]
        travel = []
        for step, heading in zip(track.steps, before, strict=False):
            turned = math.remainder(step.heading_rad - heading, 2.0 * math.pi)
            if math.hypot(*step.move_m[:2]) > 0.6 and abs(turned) < 1.5:
                toe = heading + 0.5 * turned
                travel.append(math.remainder(math.atan2(step.move_m[1], step.move_m[0]) - toe, 2.0 * math.pi))
        if travel:  # a shuffling foot makes no long step
            assert abs(np.median(travel)) < math.radians(20.0), (recording.group, recording.name)


def outbound_m(recording: FootRecording) -> float:
    """Length of the way out of an MTw's recording, by the track."""
    return recording.judge(track_of(recording))[0].value


@pytest.mark.slow
@needs_data()
def test_real_walks_with_a_lower_limit_keep_their_length() -> None:
    """MTw gyros reach 1200 deg/s. Bent off at 480 deg/s, the way out changes by 0.12 m on average; by 0.39 m without the correction."""
    recordings = [recording for recording in recordings_in(DATA, SETS) if recording.group == "mtw"]
    limited = [replace(r, gyro=fw.bent(r.gyro, np.radians(480.0))) for r in recordings]
    errors = [abs(outbound_m(a) - outbound_m(b)) for a, b in zip(recordings, limited, strict=True)]
    assert np.mean(errors) < 0.2


LEG_M = 76.0  # way of the legs of `legs_qmt`, by both feet


@needs_data("legs_qmt")
@pytest.mark.parametrize("segment", ["lower_leg_left", "lower_leg_right", "upper_leg_left", "upper_leg_right"])
def test_real_legs_are_told(segment: str) -> None:
    track = real(segment)
    length_m = sum(math.hypot(*step.move_m[:2]) for step in track.steps)
    assert "does not rest while the foot stands" in fw.doubts_of(track)
    assert LEG_M - length_m < 3.1 * track.steps[-1].scale_sd * length_m


@needs_data("legs_qmt")
def test_the_feet_of_the_same_walk_are_not() -> None:
    for segment in ("foot_left", "foot_right"):
        assert "does not rest" not in fw.doubts_of(real(segment))


@needs_data("vicon_pyshoe")
def test_a_refusal_names_an_accelerometer_that_is_wrong() -> None:
    refused = []
    for recording in (r for r in recordings_in(DATA, SETS) if r.group == "vicon"):
        refused.append(contradiction(walk_track(recording.t_s, 0.8 * recording.accel, recording.gyro)))
    assert any(refused)
    assert all("the accelerometer shows" in words and "units" not in words for words in refused if words)


@needs_data()
def test_no_public_recording_of_a_foot_is_taken_for_a_leg() -> None:
    for recording in recordings_in(DATA, SETS):
        track = walk_track(recording.t_s, recording.accel, recording.gyro)
        assert max(step.unrest for step in track.steps) < 1.0, recording.name


def real(segment: str) -> Track:
    recorded = scipy.io.loadmat(DATA / "legs_qmt" / "full_body_example_data.mat")
    samples: tuple[Floats, Floats] = tuple(np.array(recorded[segment][0, 0][name], float) for name in ("acc", "gyr"))  # type: ignore[assignment]
    return walk_track(np.ravel(recorded["t"]), *samples)


@pytest.mark.slow
@needs_data()
def test_feet_in_a_hurry_are_no_further_off_than_they_say() -> None:
    """Motion capture: 2D within 0.14 m (0.18 by the shape of plateaus alone), heights within 0.05 m, lengths of strides within their deviation."""
    recordings = [recording for recording in recordings_in(DATA, SETS) if recording.group == "vicon_more"]
    assert len(recordings) >= 4
    for recording in recordings:
        track = walk_track(recording.t_s, recording.accel, recording.gyro)
        figures = {figure.metric: figure.value for figure in recording.judge(track)}
        assert figures["2D RMSE where the truth moves"] < 0.14, recording.name
        assert figures["height RMSE"] < 0.05, recording.name
        assert recording.truth_m is not None
        assert 0.5 < _normalized(track.steps, track.position_m[:, :2], recording.truth_m, recording.t_s) < 1.6


def _normalized(steps: list[Step], track_m: Floats, truth_m: Floats, t_s: Floats) -> float:
    """Root mean square of the error of a stride's length, from lift-off to lift-off, over its standard deviation."""
    leaves = [*np.searchsorted(t_s, [step.t_start_s for step in steps]).tolist(), len(t_s) - 1]
    ratios = []
    for step, a, b in zip(steps, leaves, leaves[1:], strict=False):
        moved, truly = track_m[b] - track_m[a], truth_m[b] - truth_m[a]
        along = moved / math.hypot(*moved)
        sd = math.sqrt(float(along @ step.covariance[:2, :2] @ along))
        ratios.append((math.hypot(*moved) - math.hypot(*truly)) / sd)
    return float(np.sqrt(np.mean(np.square(ratios))))
