# SPDX-License-Identifier: MIT
"""`echostep evaluate legs --data`: real legs against the feet and against motion capture."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from echostep.errors import EchostepError
from echostep.legs.kinematics import LegLengths
from echostep.legs.stride import Flag, StrideSettings
from echostep_simulation.people.walker import Person, walk
from echostep_studies.bench.recordings.legs import SETS, LegRecording, moves_of
from echostep_studies.frame.recordings import DATA, read_sets
from echostep_studies.legs.recordings import (
    BOTH,
    LENGTHS,
    NOTHING,
    SCALE,
    method_means,
    pairs,
    recordings_study,
    rows_of,
    strides_of,
)
from needs_data import needs_data


@pytest.fixture(scope="module")
def recordings() -> list[LegRecording]:
    return read_sets(DATA, SETS)[0]


def simulated() -> LegRecording:
    """A simulated person as a recording: 30 m straight on."""
    w = walk([(0.0, 0.0), (30.0, 0.0)], Person(), np.random.default_rng(2))
    t_s, thigh, shank = (c[::10] for c in (w.t_s, w.thigh_rad_s, w.calf_rad_s))
    axis = np.array([0.48, 0.6, 0.64])
    way_s = t_s[::10]
    way = np.interp(way_s, w.t_s, w.trunk_m[:, 0])
    belt = w.belt_rad_s[::10]
    return LegRecording(
        "simulated", "right", t_s, np.outer(thigh, axis), np.outer(-shank, axis), belt, way_s, way, LegLengths()
    )


def test_rows_of_a_leg() -> None:
    rows = rows_of(simulated())
    assert [row.known for row in rows] == ["nothing", "leg lengths", SCALE]
    assert rows[0].walked_m == pytest.approx(30.0, abs=0.1)
    assert abs(rows[0].error_percent) < 6.0
    assert rows[2].walked_m < 11.0
    assert abs(rows[2].error_percent) < 5.0
    assert rows[0].error_over_sd == pytest.approx(rows[0].error_m / rows[0].sd_m, abs=0.02)
    assert method_means(rows)[0]["error_m"] == abs(rows[0].error_m)


def test_both_legs_have_rows_of_their_own() -> None:
    right = simulated()
    left = replace(right, name="left")
    assert pairs([left, right]) == [(left, right)]
    rows = rows_of(left, right)
    assert [row.known for row in rows] == [known + BOTH for known in (NOTHING, LENGTHS, SCALE)]
    assert {row.recording for row in rows} == {"both"}
    assert rows[0].walked_m == pytest.approx(30.0, abs=0.1)
    assert method_means(rows)[0]["known"] == NOTHING + BOTH


def test_folders_without_recordings_are_named(tmp_path: Path) -> None:
    with pytest.raises(EchostepError, match="no such folder"):
        recordings_study(tmp_path / "none")
    with pytest.raises(EchostepError, match="no recording"):
        recordings_study(tmp_path)
    (tmp_path / "legs_qmt").mkdir()
    (tmp_path / "legs_qmt" / "broken.mat").write_bytes(b"not a MAT file")
    assert any("broken.mat skipped, cannot read it" in line for line in read_sets(tmp_path, SETS)[1])


@needs_data("legs_gaittoolbox")
def test_a_turn_and_a_stop_in_motion_capture(recordings: list[LegRecording]) -> None:
    for recording in (r for r in recordings if r.group == "gaittoolbox"):
        assert recording.lengths is not None
        strides = strides_of([recording], StrideSettings(recording.lengths))
        assert not any(s.flags & (Flag.STAIRS_UP | Flag.STAIRS_DOWN | Flag.BACKWARD | Flag.UNSEEN) for s in strides)
        last = [s for s in strides if Flag.STANDING not in s.flags][-1]
        assert last.length_m == pytest.approx(recording.walked_m(last.t_start_s, last.t_end_s), abs=0.2)
        assert sum(s.length_m for s in strides) == pytest.approx(recording.walked_m(-math.inf, math.inf), rel=0.05)


@needs_data("legs_qmt")
def test_the_left_leg_that_was_lifted_before_the_walk(recordings: list[LegRecording]) -> None:
    left = next(r for r in recordings if (r.group, r.name) == ("qmt", "left"))
    begin_s, end_s = left.walk_s()
    assert left.walked_m(begin_s, end_s) == pytest.approx(73.0, abs=2.0)
    strides = [s for s in strides_of([left], StrideSettings()) if s.t_start_s > begin_s]
    assert not any(Flag.BACKWARD in s.flags for s in strides)
    assert sum(s.length_m for s in strides) == pytest.approx(left.walked_m(begin_s, end_s), rel=0.05)


@needs_data("legs_qmt")
def test_short_pieces_of_a_walk_with_their_own_axes_of_walking(recordings: list[LegRecording]) -> None:
    """5 m cut out of the walk, in 2.5 to 4 s: no piece is read as much shorter, by whichever axis its own samples give."""
    for leg in (r for r in recordings if r.group == "qmt"):
        begin_s, end_s = leg.walk_s()
        for t0 in np.arange(begin_s + 1.5, end_s - 6.0, 3.0).tolist():
            t1 = float(np.interp(leg.walked_m(-math.inf, t0) + 5.0, leg.way_m, leg.way_s))
            inside = (leg.t_s >= t0) & (leg.t_s < t1)
            t_s, thigh, shank, belt = (c[inside] for c in (leg.t_s, leg.thigh, leg.shank, leg.belt))
            piece = replace(leg, t_s=t_s, thigh=thigh, shank=shank, belt=belt)
            length = sum(s.length_m for s in strides_of([piece], StrideSettings()))
            assert length == pytest.approx(5.0, rel=0.15), f"{leg.name} leg at {t0:.1f} s"


@needs_data("legs_qmt")
def test_a_scale_of_a_fast_walk_holds_in_a_slower_one(recordings: list[LegRecording]) -> None:
    after = [row for r in recordings for row in rows_of(r) if row.known == SCALE]
    assert len(after) == 2
    assert np.mean([abs(row.error_percent) for row in after]) < 3.0
    assert sum(row.stairs for row in after) == 0


def test_the_way_of_an_ankle_is_from_stance_to_stance() -> None:
    t_s = np.arange(0.0, 6.0, 0.01)
    swing = np.clip(np.mod(t_s, 1.2) - 0.7, 0.0, 0.5) / 0.5
    gone = 1.4 * (np.floor(t_s / 1.2) + 0.5 * (1.0 - np.cos(np.pi * swing)))
    sway = 0.1 * np.sin(np.pi * swing)
    moves = moves_of(t_s, np.column_stack([gone, sway]) + 1e-4 * np.random.default_rng(1).standard_normal((600, 2)))
    assert [round(float(np.hypot(*move)), 2) for _, _, move in moves] == [1.4] * 4
    assert all(0.3 < end_s - start_s < 0.6 for start_s, end_s, _ in moves)
