# SPDX-License-Identifier: MIT
"""Both legs of one person: one track, a scale from each other, one file or two."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep.legs.stride import Flag, StrideSettings
from echostep_app.offline.leg_csv import LegSamples, load_pair
from echostep_app.offline.leg_pair import LEGS_DIFFER, track_pair
from echostep_app.offline.leg_side import distance_sd_m
from echostep_app.offline.leg_track import track_default
from echostep_simulation.people.walker import Person, walk

LONGER = 1.06  # by which the second leg swings farther
KEYS = ("thigh_rad_s", "shank_rad_s")


@pytest.fixture(scope="module")
def legs() -> tuple[LegSamples, LegSamples]:
    """30 m with a corner: a leg, and one whose angles are larger."""
    w = walk([(0.0, 0.0), (20.0, 0.0), (20.0, 10.0)], Person(), np.random.default_rng(4))
    t_s, thigh, shank, belt = (c[::10] for c in (w.t_s, w.thigh_rad_s, w.calf_rad_s, w.belt_rad_s))
    nothing = np.full(len(t_s), np.nan)
    first = LegSamples(t_s, thigh, shank, belt, nothing)
    return first, LegSamples(t_s, -LONGER * thigh, LONGER * shank, nothing, nothing)


def _between(samples: LegSamples, begin_s: float, end_s: float) -> LegSamples:
    inside = (samples.t_s >= begin_s) & (samples.t_s < end_s)
    columns = (getattr(samples, k)[inside] for k in ("t_s", "thigh", "shank", "belt", "compass"))
    return LegSamples(*columns)


def test_the_mean_of_both_with_a_smaller_uncertainty(legs: tuple[LegSamples, LegSamples]) -> None:
    alone = [track_default(replace(leg, belt=legs[0].belt), StrideSettings()).distance_m for leg in legs]
    assert alone[1] > 1.02 * alone[0]
    pair = track_pair(*legs, StrideSettings())
    assert pair.distance_m == pytest.approx(np.mean(alone), rel=0.005)
    assert sum(s.length_m for s in pair.strides) == pytest.approx(pair.distance_m, abs=0.01)
    assert track_pair(*legs[::-1], StrideSettings()).distance_m == pytest.approx(pair.distance_m, rel=0.002)
    scale_sd = np.sqrt(StrideSettings().scale_sd ** 2 - LEGS_DIFFER**2 / 4.0)
    assert distance_sd_m(pair.strides) == pytest.approx(scale_sd * pair.distance_m, rel=0.05)
    assert any("the other leg measures" in note and "more" in note for note in pair.notes)
    assert np.hypot(pair.rows[-1, 4] - 20.0, pair.rows[-1, 5] - 10.0) < 2.0


def test_one_leg_goes_on_with_the_scale_of_both(legs: tuple[LegSamples, LegSamples]) -> None:
    first, other = legs
    whole = track_pair(first, other, StrideSettings()).distance_m
    middle_s = float(first.t_s[len(first.t_s) // 2])
    for pair in ((first, _between(other, -1.0, middle_s)), (_between(first, -1.0, middle_s), other)):
        found = track_pair(pair[0], replace(pair[1], belt=np.full(len(pair[1].t_s), np.nan)), StrideSettings())
        assert found.distance_m == pytest.approx(whole, rel=0.015)
        assert sum(s.length_m for s in found.strides) == pytest.approx(found.distance_m, abs=0.01)


def test_a_gap_of_one_leg_is_seen_by_the_other(legs: tuple[LegSamples, LegSamples]) -> None:
    first, other = legs
    hole = (first.t_s < 8.0) | (first.t_s > 13.0)
    columns = [getattr(first, k)[hole] for k in ("t_s", "thigh", "shank", "belt", "compass")]
    found = track_pair(LegSamples(*columns), other, StrideSettings())
    assert found.distance_m == pytest.approx(track_pair(*legs, StrideSettings()).distance_m, rel=0.03)
    assert not any(Flag.GAP in s.flags for s in found.strides)
    assert track_default(LegSamples(*columns), StrideSettings()).distance_m < 0.9 * found.distance_m


def test_sensors_that_are_not_worn_do_not_halve_the_way(legs: tuple[LegSamples, LegSamples]) -> None:
    first, nothing = legs[0], np.full(len(legs[0].t_s), np.nan)
    noise = 0.002 * np.random.default_rng(1).standard_normal((2, len(first.t_s)))
    lying = LegSamples(first.t_s, noise[0], noise[1], nothing, nothing)
    alone = track_default(first, StrideSettings()).distance_m
    for pair, name in (((first, lying), "the other"), ((lying, first), "the first")):
        found = track_pair(*pair, StrideSettings())
        assert found.distance_m == pytest.approx(alone, rel=0.03)
        assert any(f"the sensors of {name} leg rest" in note for note in found.notes)
        assert distance_sd_m(found.strides) > 0.07 * alone


def test_legs_of_two_persons_and_of_two_clocks(legs: tuple[LegSamples, LegSamples]) -> None:
    first, other = legs
    wide = replace(other, thigh=1.25 * other.thigh, shank=1.25 * other.shank)
    assert any("is a sensor loose?" in note for note in track_pair(first, wide, StrideSettings()).notes)
    with pytest.raises(EchostepError, match="no time in common"):
        track_pair(first, replace(other, t_s=other.t_s + 1000.0), StrideSettings())


def _write(path: Path, header: str, *columns: Floats) -> Path:
    np.savetxt(path, np.column_stack(columns), delimiter=",", header=header, comments="", fmt="%.6f")
    return path


def test_one_file_or_two(tmp_path: Path, legs: tuple[LegSamples, LegSamples]) -> None:
    first, other = legs
    header = ",".join(["t_s", *KEYS])
    left = _write(tmp_path / "left.csv", header + ",belt_rad_s", first.t_s, first.thigh, first.shank, first.belt)
    right = _write(tmp_path / "right.csv", header, other.t_s, other.thigh, other.shank)
    names = ",".join(["t_s", *(f"other_{key}" for key in KEYS), "belt_rad_s", *KEYS])
    one = _write(tmp_path / "one.csv", names, first.t_s, other.thigh, other.shank, first.belt, first.thigh, first.shank)
    pairs = [load_pair(paths) for paths in ([left, right], [one])]
    assert [len(pair) for pair in pairs] == [2, 2]
    tracks = [track_pair(pair[0], pair[1], StrideSettings()) for pair in pairs]
    assert tracks[0].distance_m == pytest.approx(tracks[1].distance_m, rel=0.002)
    assert len(load_pair([left])) == 1
    with pytest.raises(EchostepError, match="a person has two legs"):
        load_pair([left, right, one])
    broken = _write(
        tmp_path / "broken.csv", header + ",other_thigh_rad_s", first.t_s, first.thigh, first.shank, other.thigh
    )
    with pytest.raises(EchostepError, match="no column other_shank_rad_s"):
        load_pair([broken])
