# SPDX-License-Identifier: MIT
"""`echostep calibrate`: known biases and turns come out again, and what was done wrong is said."""

from __future__ import annotations

import io
import math
import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest import mock

import numpy as np
import pytest
from numpy.typing import NDArray
from rich.console import Console

from board_runs import quiet_rows
from command_line import echostep
from echostep.board import messages as m
from echostep.board.calibration import GyroSettings, gyro_rates
from echostep.errors import EchostepError
from echostep.legs.kinematics import LegLengths
from echostep.ports.chunks import BOARD, Chunk
from echostep.settings import Settings, parse_settings
from echostep_app.commissioning.calibrate import STILL_S, TURN_S, WALK_S, Ports, Wearer, calibrate, write_sections
from echostep_app.commissioning.fitting import doubt, fit_compass, fit_gyros, fit_legs, fit_mounting, still_bias
from echostep_app.commissioning.probe import ProbeResult, _Probe
from echostep_simulation.devices.board import PythonBoard
from echostep_simulation.devices.board_sensors import Adis16100Model
from echostep_simulation.people.walker import Person, walk
from echostep_studies.simulation.devices.rehearsal import Act, Rehearsal
from players import pseudo_terminal, python_board, some_noise
from snapshots import expect, refusal
from walks import PLAN

COUNT_RAD_S = math.radians(0.2439)


def heard(belt: NDArray[Any], bearing: NDArray[Any] | None = None) -> ProbeResult:
    """A minute's worth of listening, from rates in counts at 200 Hz and bearings at 10 Hz."""
    found = ProbeResult()
    for k, value in enumerate(np.rint(belt).astype(int).tolist()):
        found.gyros.append(m.Gyros(0, 41, -32768, value))
        found.ticks.setdefault("Gyros", []).append(10_000 * k)
    for k, value in enumerate([] if bearing is None else np.rint(bearing).astype(int).tolist()):
        found.compass.append(m.Compass(0, value))
        found.ticks.setdefault("Compass", []).append(200_000 * k)
    return found


def turn(seconds: float, degrees: float, reversed_: bool = False) -> ProbeResult:
    t_s = np.arange(0.0, seconds, 0.005)
    rate = np.full(len(t_s), degrees / seconds / 0.2439 * (-1 if reversed_ else 1)) + 9
    bearing = (900.0 - 10 * degrees * np.arange(0.0, 1.0, 0.1 / seconds)) % 3600
    return heard(rate, np.minimum(np.floor(bearing), 3599))


USUAL = {"thigh": 9, "calf": -12, "belt": 5}  # biases in counts


def usual(rows: NDArray[Any], start_ms: int) -> None:
    """A quiet person whose gyros have biases that are usual."""
    some_noise(rows, start_ms)
    for name, count in USUAL.items():
        rows[name] += count - quiet_rows(1)[name][0]


@pytest.mark.long
def test_biases_go_into_a_file_that_the_tracker_reads(tmp_path: Path) -> None:
    out = tmp_path / "me.toml"
    out.write_text("[foot]\nheight_m = 1.8\n\n[gyro]\nbelt_reversed = true\n")
    with python_board(usual) as port:
        done = echostep("calibrate", "gyros", "--board", port, "--out", out)
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
    settings = parse_settings(out.read_text(), "me.toml")
    assert settings.foot.height_m == 1.8  # what was there stays
    assert settings.gyro.belt_reversed
    for name, counts in USUAL.items():
        assert getattr(settings.gyro, f"{name}_bias_rad_s") == pytest.approx(counts * COUNT_RAD_S, abs=0.0015)
    assert re.search(r"thigh \+2\.[12]\d degrees/s \(noise 0\.[56]\d\)", done.stdout), done.stdout


def test_settings_that_cannot_be_written_whole_leave_those_before(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "s.toml"
    write_sections(out, {"gyro": {"thigh_bias_rad_s": 0.01}})
    before = out.read_text()
    monkeypatch.setattr("os.fsync", mock.Mock(side_effect=OSError(28, "No space left on device")))
    with pytest.raises(EchostepError, match=r"s\.toml: cannot write the settings: No space left"):
        write_sections(out, {"gyro": {"thigh_bias_rad_s": 0.02}})
    assert [path.read_text() for path in tmp_path.iterdir()] == [before]


@pytest.mark.parametrize("reversed_", [False, True])
@pytest.mark.parametrize("degrees", [360.0, -400.0, 330.0])
def test_the_way_round_the_belt_gyro_is_worn(reversed_: bool, degrees: float) -> None:
    found, line = fit_mounting(turn(20.0, degrees, reversed_), Settings())
    assert found == {"gyro": {"belt_reversed": reversed_}}
    assert ("upside down" in line) == reversed_


@pytest.mark.parametrize("reversed_", [False, True])
def test_the_iron_of_the_wearer_is_found(reversed_: bool) -> None:
    """Hard iron of 12 degrees, soft iron of 4, a belt gyro with a bias, a degree of noise."""
    t_s = np.arange(0.0, 20.0, 0.005)
    heading = 0.3 + np.radians(400.0) * t_s / 20.0 + 0.1 * np.sin(t_s)
    shown = heading + np.radians(12.0) * np.sin(heading) - np.radians(4.0) * np.cos(2 * heading)
    rng = np.random.default_rng(3)
    counts = np.gradient(heading, t_s) / COUNT_RAD_S * (-1 if reversed_ else 1) + 15 + rng.normal(0, 2.5, len(t_s))
    bearing = np.degrees(np.pi / 2 - shown[::20]) * 10 + rng.normal(0.0, 10.0, 200)
    found, line = fit_compass(
        heard(counts, np.floor(bearing % 3600)), Settings(gyro=GyroSettings(belt_bias_rad_s=12 * COUNT_RAD_S))
    )
    values = found["compass"]
    assert math.degrees(values["sin1"]) == pytest.approx(12.0, abs=0.7)
    assert math.degrees(values["cos1"]) == pytest.approx(0.0, abs=0.7)
    assert math.degrees(values["cos2"]) == pytest.approx(-4.0, abs=0.7)
    assert 0.5 < math.degrees(values["rms_rad"]) < 1.5
    assert "degrees are left" in line


def walked(metres: float, *, swapped: bool = False) -> ProbeResult:
    """What the board says of somebody who walks straight on; simulated."""
    person = Person()
    path = walk([(0.0, 0.0), (metres, 0.0)], person, np.random.default_rng(5))
    found = ProbeResult()
    thigh, calf = (
        Adis16100Model(np.random.default_rng(k)).counts(rate[::5])
        for k, rate in enumerate((path.thigh_rad_s, path.calf_rad_s))
    )
    for k, pair in enumerate(zip(thigh.tolist(), calf.tolist(), strict=True)):
        found.gyros.append(m.Gyros(0, *(pair[::-1] if swapped else pair), 0))
        found.ticks.setdefault("Gyros", []).append(10_000 * k)
    return found


def test_the_scale_of_the_legs_follows_the_walk() -> None:
    leg = Person().leg
    segments = LegLengths(leg.thigh_m, leg.shank_m)
    found, line = fit_legs(walked(10.0), GyroSettings(), segments, 10.0)
    assert found["wearer"]["leg_scale"] == pytest.approx(1.0, abs=0.06)
    twice, _ = fit_legs(walked(10.0), GyroSettings(), segments, 11.0)
    assert twice["wearer"]["leg_scale"] == pytest.approx(1.1 * found["wearer"]["leg_scale"], abs=0.001)
    assert "10 m was measured as" in line
    assert parse_settings("[wearer]\nleg_scale = 1.02\nthigh_m = 0.4\n", "x").wearer.leg_scale == 1.02


EVEN = np.arange(2_000) * 0.0 + 19.7 / 0.2439  # counts of a turn at 19.7 degrees/s


def test_what_was_done_wrong_and_what_hardly_anybody_has() -> None:
    rng = np.random.default_rng(1)
    swaying = 60.0 * np.sin(np.arange(2_000) * 0.02) + rng.normal(0, 2.5, 2_000)
    refused = {
        "half a turn": lambda: fit_mounting(turn(20.0, 170.0), Settings()),
        "a compass that stands still": lambda: fit_compass(
            heard(np.full(4_000, 80.0), np.full(200, 900.0)), Settings()
        ),
        "gyros swapped": lambda: fit_legs(walked(10.0, swapped=True), GyroSettings(), LegLengths(), 10.0),
        "another distance": lambda: fit_legs(walked(10.0), GyroSettings(), LegLengths(), 80.0),
        "no leg": lambda: fit_legs(ProbeResult(), GyroSettings(), LegLengths(), 10.0),
        "swaying": lambda: fit_gyros(heard(swaying)),
        "a great bias": lambda: fit_gyros(heard(rng.normal(400.0, 2.5, 2_000))),
        "no gyro": lambda: fit_gyros(ProbeResult()),
    }
    expect("calibrate", {case: refusal(fit) for case, fit in refused.items()}, within=0.5)
    doubted: dict[str, dict[str, dict[str, float | bool]]] = {
        "doubt: bias": {"gyro": {"belt_bias_rad_s": math.radians(19.7)}},
        "doubt: long strides": {"wearer": {"leg_scale": 2.1}},
        "doubt: none": {
            "gyro": {"calf_bias_rad_s": math.radians(-4.0), "belt_reversed": True},
            "wearer": {"leg_scale": 1.2},
        },
    }
    expect("calibrate", {case: doubt(values) for case, values in doubted.items()})


@pytest.mark.parametrize("answer", ["y", "", None])
def test_an_even_turn_is_no_bias_unless_a_person_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, answer: str | None
) -> None:
    """`answer` None: nobody is at the terminal."""
    out, asked = tmp_path / "me.toml", []

    def said(prompt: str = "") -> str:
        asked.append(prompt)
        return answer or ""

    console = Console(file=io.StringIO(), soft_wrap=True)
    monkeypatch.setattr(console, "input", said)
    monkeypatch.setattr("sys.stdin", SimpleNamespace(isatty=lambda: answer is not None))
    monkeypatch.setattr("echostep_app.commissioning.calibrate.find_boards", lambda *_: ("x", None))
    monkeypatch.setattr("echostep_app.commissioning.calibrate.access_findings", lambda *_: [])
    monkeypatch.setattr("echostep_app.commissioning.calibrate._probe", lambda *_: heard(EVEN))
    wearer = Wearer(0.43, 0.43, 10.0)
    if answer == "y":
        calibrate(Ports("x"), ["gyros"], wearer, out, console)
        assert parse_settings(out.read_text(), "me.toml").gyro.belt_bias_rad_s == pytest.approx(
            math.radians(19.7), abs=0.01
        )
    else:
        with pytest.raises(EchostepError, match=r"a turn at an even pace looks like that.*nothing was written of it"):
            calibrate(Ports("x"), ["gyros"], wearer, out, console)
        assert not out.exists()
    assert bool([prompt for prompt in asked if "Write it all the same? [y/N]" in prompt]) is (answer is not None)


def test_a_start_or_a_cough_in_between_does_no_harm() -> None:
    rng = np.random.default_rng(2)
    rate = rng.normal(12.0, 2.5, 2_000)
    rate[700:850] += 90.0 * np.hanning(150)
    bias, noise = still_bias(0.005 * np.arange(2_000.0), np.multiply(rate, COUNT_RAD_S, dtype=np.float64))
    assert bias == pytest.approx(12.0 * COUNT_RAD_S, abs=0.001)
    assert noise == pytest.approx(2.5 * COUNT_RAD_S, rel=0.1)


def test_a_gyro_that_does_not_answer_is_named_and_left_out() -> None:
    found, line = fit_gyros(heard(np.full(2_000, 5.0)))
    assert set(found["gyro"]) == {"thigh_bias_rad_s", "belt_bias_rad_s"}
    assert "calf none" in line


def test_rates_without_bias() -> None:
    rows = np.array([(0, 41, -82, 5), (1, 41, -32768, 6)], m.ROWS[m.Gyros(0, 0, 0, 0).id])
    settings = GyroSettings(41 * COUNT_RAD_S, 0.0, 5 * COUNT_RAD_S, belt_reversed=True)
    assert gyro_rates(rows, settings) == pytest.approx(
        COUNT_RAD_S * np.array([[0.0, -82.0, 0.0], [0.0, np.nan, -1.0]]), nan_ok=True
    )


def test_mistakes_end_with_one_line(tmp_path: Path) -> None:
    (tmp_path / "bad.toml").write_text("[gyro]\nnonsense = 1\n")
    out = ["--out", tmp_path / "x.toml"]
    with pseudo_terminal() as (_, silent):
        mistakes: dict[str, list[object]] = {
            "no such part": ["nonsense", *out],
            "too short a walk": ["legs", "--walked", "0.5", "--board", silent, *out],
            "too long a thigh": ["legs", "--thigh", "43", "--board", silent, *out],
            "no such port": ["--board", "/dev/no-such-port", *out],
            "settings that are wrong": ["gyros", "--board", silent, "--out", tmp_path / "bad.toml"],
        }
        expect(
            "calibrate",
            {case: echostep("calibrate", *words) for case, words in mistakes.items()},
            FOLDER=tmp_path,
            PORT=silent,
        )
    assert not (tmp_path / "x.toml").exists()


@pytest.mark.long
def test_the_rehearsal_of_the_twin_calibrates_everything() -> None:
    """What the wearer of `make twin STILL=1` does, as the Python board reports it, without waiting for it."""
    board = PythonBoard()
    acts = Rehearsal(PLAN, 1, board)
    heard_in: dict[Act, ProbeResult] = {}
    for act, seconds in ((Act.STAND, STILL_S), (Act.TURN, TURN_S), (Act.WALK, WALK_S)):
        running = _Probe(SimpleNamespace(notices=[]), {BOARD: "x"}, check_gyros=False)  # type: ignore[arg-type]
        for begin_ms in range(0, int(seconds * 1e3), 10):
            for t_ns, sent in board.advance(acts.rows(act, begin_ms, 10)):
                running._receive(Chunk(BOARD, t_ns, sent))
        heard_in[act] = running.result
    biases: dict[str, Any] = dict(fit_gyros(heard_in[Act.STAND])[0]["gyro"])
    gyros = GyroSettings(**biases)
    assert fit_mounting(heard_in[Act.TURN], Settings(gyro=gyros))[0] == {"gyro": {"belt_reversed": False}}
    assert math.degrees(fit_compass(heard_in[Act.TURN], Settings(gyro=gyros))[0]["compass"]["rms_rad"]) < 3.0
    scale = fit_legs(heard_in[Act.WALK], gyros, LegLengths(), 10.0)[0]["wearer"]["leg_scale"]
    assert scale == pytest.approx(1.0, abs=0.08)
