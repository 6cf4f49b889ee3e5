# SPDX-License-Identifier: MIT
"""`echostep calibrate rangers`: what is known of simulated rangers comes out again; a wrong mounting is named, a right one is not."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from board_runs import needs_twin
from command_line import echostep, interrupt_when
from echostep.arrays import Floats
from echostep.board.calibration import RangerSettings, ranges
from echostep.board.messages import ROWS, Outcome
from echostep.echoes.likelihood import EchoSettings
from echostep.errors import EchostepError
from echostep.plan import load_plan
from echostep.ports.chunks import BOARD, Chunk
from echostep.settings import parse_settings
from echostep.walls.echo_sources import Walls
from echostep_app.commands.actions.rangers import PLAN_NEEDED, calibrate_rangers
from echostep_app.commissioning.rangers.fit import BIAS, fit_ranger
from echostep_app.commissioning.rangers.known_pings import KnownPings, known_pings
from echostep_app.commissioning.rangers.poses import PosedPings
from echostep_app.commissioning.rangers.report import RangerReport, report
from echostep_app.printing.console import console_for_people
from echostep_app.session.metadata import run_metadata, start_recording
from echostep_app.session.options import TrackingOptions
from echostep_simulation.devices.board import PythonBoard
from echostep_simulation.scenario import demo_scenario
from echostep_simulation.world.acoustics import PULSE_RANGER, SRF02, Acoustics
from echostep_simulation.world.echoes import Echoes, echoes
from players import walking_twin
from waiting import PATIENCE_S
from walks import DEMO

# A corridor 2 m wide with two rooms of 6 m x 4 m
ROOMS = np.array(
    [[0, 0, 12, 0], [12, 0, 12, 2], [12, 2, 8.5, 2], [7.5, 2, 4.5, 2], [3.5, 2, 0, 2], [0, 2, 0, 0], [6, 2, 6, 6], [0, 6, 12, 6],
     [0, 2, 0, 6], [12, 2, 12, 6]], float,
)  # fmt: skip
WAY = np.array(
    [[1, 1], [11, 1], [8, 1], [8, 5], [11, 4], [8, 3], [8, 1], [4, 1], [4, 5], [1, 4], [4, 3], [4, 1], [1, 1]], float
)
STEP_M, SWAY_RAD, PLACE_SD_M = 0.1, 0.05, 0.03
Change = Callable[[Floats, np.random.Generator], Floats]


def pings_of(
    acoustics: Acoustics = SRF02, left_ahead_deg: float = 0.0, *, swapped: bool = False, change: Change | None = None
) -> tuple[Floats, PosedPings]:
    """Biases (2,), and pings on a walk of a minute; `change`: what else the right ranger hears."""
    rng = np.random.default_rng(1)
    xy = np.vstack(
        [
            p + (q - p) * np.arange(0.0, 1.0, STEP_M / np.hypot(*(q - p)))[:, None]
            for p, q in zip(WAY, WAY[1:], strict=False)
        ]
    )
    course = np.arctan2(*np.diff(xy, axis=0, append=xy[-1:] + [[-0.1, 0.0]]).T[::-1])
    heading = course + SWAY_RAD * rng.standard_normal(len(xy))
    bias_m, rows = acoustics.bias_m * rng.standard_normal(2), []
    for k, ahead_deg in enumerate((left_ahead_deg, 0.0)):
        turned = heading - math.radians(ahead_deg)
        us = echoes(xy, turned, ROOMS, bias_m, rng, acoustics).own_us[:, 1 - k if swapped else k].astype(float)
        range_m = np.where(us > 0.0, us * (0.5e-6 * acoustics.speed_m_s), np.nan)
        range_m = change(range_m, rng) if change and k == 1 else range_m
        place = xy + PLACE_SD_M * rng.standard_normal(xy.shape)
        rows.append(np.column_stack([np.full(len(xy), k), place, heading + (0.5 - k) * math.pi, range_m]))
    ranger, x, y, axis, ranges_m = np.stack(rows, axis=1).reshape(-1, 5).T
    return bias_m, PosedPings(ranger.astype(np.int64), x, y, axis, ranges_m, 1.0, 0)


def judged(pings: PosedPings) -> RangerReport:
    return report(pings, Walls(ROOMS), EchoSettings(), RangerSettings())


def of_ranger(pings: PosedPings, which: int) -> KnownPings:
    own = pings.ranger == which
    return known_pings(Walls(ROOMS), pings.x_m[own], pings.y_m[own], pings.axis_rad[own], pings.range_m[own])


def half_reach_m(threshold_db: float) -> float:
    """Where a wall straight ahead has the level of the threshold: spreading and absorption there and back."""
    away = np.arange(0.5, 7.0, 0.001)
    level = -20.0 * np.log10(away) - 2.6 * (away - 1.0)
    return float(away[int(np.argmax(level < threshold_db))])


WEAK = SRF02._replace(threshold_db=-18.0)


@pytest.mark.parametrize("acoustics", [SRF02, WEAK])
def test_reach_and_biases_come_out_again_and_held_out_pings_are_predicted_better(acoustics: Acoustics) -> None:
    bias_m, pings = pings_of(acoustics)
    found = judged(pings)
    assert found.faults == []
    assert [found.values["ranger"][f"{side}_bias_m"] for side in ("left", "right")] == pytest.approx(bias_m, abs=0.008)
    assert found.values["echo"]["maximum_m"] == pytest.approx(half_reach_m(acoustics.threshold_db), rel=0.08)
    fit = fit_ranger(of_ranger(pings, 0), EchoSettings())
    assert abs(fit.values[BIAS] - bias_m[0]) < 4.0 * fit.sd[BIAS] < 0.02
    assert fit.score > fit.score_before + 3.0 * fit.gain_sd


def test_a_bias_that_the_walk_had_as_a_setting_is_kept() -> None:
    """The walk's ranges are without it, so the fit finds only what is left."""
    _, pings = pings_of()
    known = RangerSettings(left_bias_m=0.05)
    once, again = (
        report(pings, Walls(ROOMS), EchoSettings(), settings).values["ranger"] for settings in (RangerSettings(), known)
    )
    assert again["left_bias_m"] == pytest.approx(once["left_bias_m"] + 0.05)
    assert again["right_bias_m"] == once["right_bias_m"]


def test_a_setting_of_a_bias_is_taken_off_each_ranger_s_own_ranges() -> None:
    """2000 and 20 us are 0.343 and 0.003 m; what is shorter than a centimetre stays."""
    pings = np.zeros(4, ROWS[0x02])
    pings["outcome"] = Outcome.ECHO
    pings["ranger"] = [0, 1, 0, 0]
    pings["time_of_flight_us"] = [2000, 2000, 20, 100]
    usual, own = (
        ranges(pings, settings) for settings in (RangerSettings(), RangerSettings(left_bias_m=0.05, right_bias_m=-0.02))
    )
    assert own - usual == pytest.approx([-0.05, 0.02, 0.0, 0.01 - usual[3]])


def test_the_least_range_is_lowered_by_echoes_that_are_shorter() -> None:
    near = PULSE_RANGER._replace(minimum_m=0.02)
    _, pings = pings_of(near)
    shortest = np.where(np.arange(len(pings.range_m)) < 5, 0.06, pings.range_m)
    assert judged(pings._replace(range_m=shortest)).values["echo"]["minimum_m"] == 0.06
    assert "minimum_m" not in judged(pings).values["echo"]


def test_a_narrow_beam_is_told_from_a_wide_one() -> None:
    _, wide = pings_of()
    _, narrow = pings_of(SRF02._replace(size=8.56))  # 6 dB down at 15 degrees each way: more than 15 dB at 27.5
    beams = [fit_ranger(of_ranger(pings, 0), EchoSettings()).values["rim_db"] for pings in (wide, narrow)]
    assert beams[0] == pytest.approx(6.0, abs=1.5)
    assert beams[1] > 15.0


def test_the_settings_are_read_by_the_tracker() -> None:
    values = judged(pings_of(WEAK)[1]).values
    text = "\n".join(f"[{name}]\n" + "\n".join(f"{k} = {v}" for k, v in rows.items()) for name, rows in values.items())
    assert parse_settings(text, "here").echo.maximum_m == values["echo"]["maximum_m"]


def answered(share: float, nearest_m: float, farthest_m: float) -> Change:
    """Something else answers a share of the pings."""
    return lambda z, rng: np.where(rng.random(len(z)) < share, rng.uniform(nearest_m, farthest_m, len(z)), z)


@pytest.mark.parametrize(
    ("named", "pings"),
    [
        ("The rangers are swapped", lambda: pings_of(swapped=True)),
        ("The left ranger looks about 45 degrees ahead of abeam", lambda: pings_of(left_ahead_deg=45.0)),
        ("The left ranger looks about 45 degrees behind abeam", lambda: pings_of(left_ahead_deg=-45.0)),
        ("The right ranger is covered", lambda: pings_of(change=answered(0.8, 0.15, 0.2))),
        ("The right ranger hears nothing", lambda: pings_of(change=lambda z, _: np.full(len(z), np.nan))),
        ("The right ranger hears the arm", lambda: pings_of(change=answered(0.3, 0.3, 0.6))),
        ("The right ranger points down", lambda: pings_of(change=lambda z, _: np.where(z < 1.5, z, 1.6))),
    ],
)  # fmt: skip
def test_a_fault_is_named_alone_and_nothing_is_written(
    named: str, pings: Callable[[], tuple[Floats, PosedPings]]
) -> None:
    found = judged(pings()[1])
    assert [fault.startswith(named) for fault in found.faults] == [True]
    assert found.values == {}


def test_a_person_who_passes_is_no_fault() -> None:
    assert judged(pings_of(change=answered(0.05, 0.3, 1.0))[1]).faults == []


def test_a_walk_that_is_not_believed_or_too_short_gives_no_settings() -> None:
    _, pings = pings_of()
    unbelieved = judged(pings._replace(believed=0.3))
    assert "the place is known for 30 %" in unbelieved.lines[0].lower()
    first: Any = [
        *(column[:300] for column in (pings.ranger, pings.x_m, pings.y_m, pings.axis_rad, pings.range_m)),
        1.0,
        0,
    ]
    short = judged(PosedPings(*first))
    assert "200 are needed" in short.lines[0]
    assert unbelieved.values == short.values == {}


def recorded(folder: Path, settings_toml: str = "") -> Path:
    """The simulated demo walk."""
    plan = load_plan(DEMO)
    scenario = demo_scenario(plan, 3, PythonBoard(3))
    with start_recording(
        folder / "walk.mcap", run_metadata(plan, plan.start, 1, "simulated", settings_toml, source="simulated")
    ) as recorder:
        for chunk in scenario.chunks():
            recorder.write(chunk)
    return Path(recorder.path)


def calibrated(walk: Path) -> str:
    """The settings that the command writes."""
    out = walk.parent / "rangers.toml"
    calibrate_rangers([walk], TrackingOptions(DEMO), out, console_for_people(highlight=False))
    return out.read_text()


@pytest.mark.long
def test_biases_come_out_of_a_recorded_walk_into_the_settings(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The tracker has used the same pings: between two walls only half of what both rangers have in common would be left otherwise."""
    monkeypatch.setattr("echostep_simulation.stimulus.ranger_bias_m", lambda *_: np.array([0.06, 0.02]))
    settings = parse_settings(calibrated(recorded(tmp_path)), "here")
    assert settings.ranger.left_bias_m == pytest.approx(0.06, abs=0.025)
    assert settings.ranger.right_bias_m == pytest.approx(0.02, abs=0.025)


@pytest.mark.long
def test_swapped_rangers_of_a_recorded_walk_are_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def swapped(*given: Any) -> Echoes:
        found = echoes(*given)
        return Echoes(found.own_us[:, ::-1].copy(), found.cross_us[:, ::-1].copy())

    monkeypatch.setattr("echostep_simulation.stimulus.echoes", swapped)
    with pytest.raises(EchostepError, match="rangers are swapped"):
        calibrated(recorded(tmp_path))
    assert not (tmp_path / "rangers.toml").exists()


def test_a_plan_is_asked_for(tmp_path: Path) -> None:
    done = echostep("calibrate", "rangers", tmp_path / "walk.mcap", ends=2)
    assert PLAN_NEEDED in " ".join(done.stderr.split())


@pytest.mark.twin
@pytest.mark.long
@needs_twin
@pytest.mark.filterwarnings("ignore:set(Daemon|Name):DeprecationWarning")  # in pyserial
def test_a_wearer_who_walks_now_is_guided_recorded_and_judged(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("echostep_app.commands.actions.rangers.GUIDED_S", 5 * PATIENCE_S)
    of_board, out = Counter[str](), tmp_path / "rangers.toml"

    def walked_enough(chunk: Chunk) -> bool:
        """A fifth of the demo walk, however late the twin is."""
        of_board[chunk.port] += len(chunk.data)
        return of_board[BOARD] > 100_000

    interrupt_when(walked_enough, monkeypatch)
    with walking_twin(tmp_path) as (board, mtx):
        done = echostep("calibrate", "rangers", "--plan", DEMO, "--board", board, "--mtx", mtx, "--out", out)
    assert done.returncode == 0, done.stderr
    words = " ".join(done.stdout.split())
    assert "begin at the start that is marked on the plan" in words
    assert (tmp_path / "rangers.mcap").exists()
    few = re.findall(r"The (left|right) ranger sent \d+ pings where the place is known: 200 are needed", words)
    assert set(few + re.findall(r"(left|right): log-score of", words)) == {
        "left",
        "right",
    }  # more, where the twin kept its pace
    assert out.exists() == ("use it with --settings" in words)
