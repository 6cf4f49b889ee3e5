# SPDX-License-Identifier: MIT
"""Files of legs and their tracks: bad files are named, columns and axes guessed, the command and its calibration."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep.legs.heading import Heading, HeadingSettings
from echostep.legs.stride import StrideSettings
from echostep_app.cli import app
from echostep_app.offline.leg_csv import LegSamples, load_legs
from echostep_app.offline.leg_side import distance_sd_m
from echostep_app.offline.leg_track import _adopt_errors, describe_legs, track_default
from echostep_simulation.people.walker import Person, walk
from echostep_studies.papers.profiles import track_lee2010
from legs.leg_walks import STANDARD, strides_of, total_m, walked


@pytest.mark.parametrize("size", [0.3, 1.0, 10.0])
@pytest.mark.parametrize("seed", range(3))
def test_noise_is_no_walk(size: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    nothing = np.full(3000, np.nan)
    thigh, shank = size * rng.standard_normal((2, 3000))
    t: Floats = np.arange(3000.0) * 0.01
    samples = LegSamples(t, thigh, shank, nothing, nothing)
    found = describe_legs(track_default(samples, StrideSettings()))
    assert "do not trust" in found or "no step was seen" in found or "exchanged" in found


def test_exchanged_columns_are_guessed() -> None:
    t, thigh, shank = walked([(0.0, 0.0), (20.0, 0.0)])
    nothing = np.full(len(t), np.nan)
    assert "exchanged" in describe_legs(track_default(LegSamples(t, shank, thigh, nothing, nothing), StrideSettings()))


def _samples(seed: int = 3) -> LegSamples:
    rng = np.random.default_rng(seed)
    w = walk([(0.0, 0.0), (15.0, 0.0), (15.0, 10.0)], Person(), rng)
    at = slice(None, None, 5)
    compass = np.where(
        np.arange(len(w.t_s[at])) % 20 == 0, w.heading_rad[at] + 0.05 * rng.standard_normal(len(w.t_s[at])), np.nan
    )
    return LegSamples(w.t_s[at], w.thigh_rad_s[at], -w.calf_rad_s[at], -w.belt_rad_s[at], compass)


@pytest.mark.parametrize("method", [track_default, track_lee2010])
def test_the_track_turns_the_corner(method: type) -> None:
    rows = method(_samples(), StrideSettings(STANDARD)).rows
    assert rows.shape[1] == 6
    assert np.hypot(rows[-1, 4] - 15.0, rows[-1, 5] - 10.0) < 2.5
    assert rows[-1, 1] == pytest.approx(25.0, rel=0.1)


def _write(path: Path, header: str, rows: Floats) -> Path:
    path.write_text(
        "\n".join([header, *(",".join("" if math.isnan(v) else f"{v:.6f}" for v in row) for row in rows.tolist())])
        + "\n"
    )
    return path


HEADER = "t_s,thigh_rad_s,shank_rad_s"


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda r: r * [1.0, 57.3, 57.3], "deg/s"),
        (lambda r: r * [1000.0, 1.0, 1.0], "milliseconds"),
        (lambda r: r * [1.0, 0.0, 1.0], "thigh_rad_s is constant"),
        (lambda r: r[:, [0, 1, 1]], "same numbers"),
        (lambda r: r[::30], "50 at least"),
        (lambda r: np.where(np.arange(len(r))[:, None] % 4 > 0, np.nan, r), "no number"),
        (lambda r: r[:1], "no samples"),
    ],
)
def test_bad_files_are_named(tmp_path: Path, change: object, words: str) -> None:
    rows = np.column_stack(walked([(0.0, 0.0), (8.0, 0.0)]))
    assert callable(change)
    path = _write(tmp_path / "legs.csv", HEADER, change(rows))
    with pytest.raises(EchostepError, match=words):
        load_legs(path)


def test_a_header_in_degrees_and_other_files(tmp_path: Path) -> None:
    (tmp_path / "deg.csv").write_text("t_s,thigh_deg_s,shank_deg_s\n0,1,2\n")
    with pytest.raises(EchostepError, match="looks like degrees"):
        load_legs(tmp_path / "deg.csv")
    (tmp_path / "noise.bin").write_bytes(np.random.default_rng(1).bytes(40_000))
    with pytest.raises(EchostepError, match="no column"):
        load_legs(tmp_path / "noise.bin")
    with pytest.raises(EchostepError, match="cannot read"):
        load_legs(tmp_path / "none.csv")


def test_three_axes_give_the_track_of_one(tmp_path: Path) -> None:
    t, thigh, shank = walked([(0.0, 0.0), (10.0, 0.0)])
    axis = np.array([0.48, 0.6, 0.64])
    rows = np.column_stack([t, np.outer(thigh, axis), np.outer(-shank, axis[::-1])])
    header = "t_s,thigh_x,thigh_y,thigh_z,shank_x,shank_y,shank_z"
    found = load_legs(_write(tmp_path / "three.csv", header, rows))
    one = load_legs(_write(tmp_path / "one.csv", HEADER, np.column_stack([t, thigh, shank])))
    distance = [track_default(samples, StrideSettings(STANDARD)).distance_m for samples in (found, one)]
    assert distance[0] == pytest.approx(distance[1], abs=0.02)
    assert any("thigh: the axis of walking is 50 degrees from the sensor's z" in note for note in found.notes)
    with pytest.raises(EchostepError, match="no column thigh_rad_s"):
        load_legs(_write(tmp_path / "two.csv", header.replace("thigh_z", "thigh_w"), rows))
    circle = [np.sin(6.0 * t), np.cos(6.0 * t), 0.1 * np.sin(t)]
    round_ = np.column_stack([t, *circle, *circle[::-1]])
    assert any("no axis of walking" in note for note in load_legs(_write(tmp_path / "round.csv", header, round_)).notes)
    round_[:-5, 1] = np.nan
    with pytest.raises(EchostepError, match="number"):
        load_legs(_write(tmp_path / "holes.csv", header, round_))


def test_the_command_and_its_calibration(tmp_path: Path) -> None:
    rows = np.column_stack(walked([(0.0, 0.0), (10.0, 0.0)]))
    path, out = _write(tmp_path / "legs.csv", HEADER, rows), tmp_path / "track.csv"
    base = ["legs", str(path), "--thigh", "0.43", "--shank", "0.43", "--out", str(out)]
    shown = CliRunner().invoke(app, [*base, "--walked", "10"])
    assert shown.exit_code == 0
    scale = shown.output.split("--scale ")[1].split()[0]
    again = CliRunner().invoke(app, [*base, "--scale", scale, "--picture", str(picture := tmp_path / "legs.pdf")])
    assert picture.read_bytes()[:4] == b"%PDF"
    assert f"track: {out}, picture: {picture}" in again.output.replace("\n", "")
    assert "stride 1: " in again.output
    assert "beginning or end of a walk" in again.output
    assert "10.00 m" in again.output
    assert out.read_text().splitlines()[0] == "t_s,distance_m,speed_m_s,heading_rad,x,y"
    assert CliRunner().invoke(app, [*base, "--profile", "lee2010"]).exit_code == 0
    for extra in (["--profile", "x"], ["--scale", "9"], ["--walked", "99"], ["--thigh", "43"]):
        assert isinstance(CliRunner().invoke(app, [*base, *extra]).exception, EchostepError)


def test_a_second_pass_knows_the_bias_from_the_beginning() -> None:
    rng, t = np.random.default_rng(3), np.arange(0.0, 90.0, 0.02)
    compass = np.where(np.arange(len(t)) % 5 == 0, math.radians(3.0) * rng.standard_normal(len(t)), np.nan)
    rate, settings = np.full_like(t, math.radians(0.4)), HeadingSettings(disturbance_rad=math.radians(3.0), same_s=0.1)
    first, second = (Heading(settings, 0.0, math.radians(1.0)) for _ in range(2))
    once = first.feed(t, rate, compass)
    _adopt_errors(second, first)
    assert second.bias_sd_rad_s == first.bias_sd_rad_s
    assert np.abs(second.feed(t, rate, compass)[:, 0]).max() < 0.7 * np.abs(once[:, 0]).max()


@pytest.mark.parametrize("method", [track_default, track_lee2010])
def test_a_long_gap_is_no_way(method: type) -> None:
    t, thigh, shank = walked([(0.0, 0.0), (20.0, 0.0)])
    later, nothing = np.where(t > 9.0, t + 1e6, t), np.full(len(t), np.nan)
    rows = method(LegSamples(later, thigh, shank, nothing, nothing), StrideSettings(STANDARD)).rows
    assert rows[-1, 1] < 25.0


def test_a_way_is_as_well_known_as_it_says() -> None:
    strides = strides_of(*walked([(0.0, 0.0), (25.0, 0.0, 3.0), (25.0, 20.0)]))
    assert abs(total_m(strides) - 45.0) < 3.0 * distance_sd_m(strides)
