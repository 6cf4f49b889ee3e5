# SPDX-License-Identifier: MIT
"""`echostep calibrate accelerometers`: known errors of parts that lie on their sides come out again, and what was done wrong is said."""

from __future__ import annotations

import importlib
import io
import math
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from rich.console import Console

from board_runs import ELF, TWIN, needs_twin
from command_line import echostep
from echostep.board import messages as m
from echostep.board.calibration import ICM20649_M_S2, ImuSettings
from echostep.board.foot_board import FootBoardReader
from echostep.board.frames import encode
from echostep.board.reports import SUBSCRIBE
from echostep.errors import EchostepError
from echostep.ports.chunks import BOARD, Chunk
from echostep.settings import Settings, parse_settings
from echostep_app.commissioning import calibrate
from echostep_app.commissioning.imu_errors import POSES, RestPose, check_unlike, fit_errors, pose_of
from echostep_app.commissioning.poses import TRIES, measure_poses
from echostep_app.commissioning.probe import ProbeResult, _Probe
from echostep_simulation.devices.board import BoardProcess
from echostep_studies.simulation.devices.rehearsal import LyingParts
from players import playing
from snapshots import expect, refusal

G = 9.81
SIDES = np.vstack([np.eye(3), -np.eye(3)])
OFFSET_ERROR, SCALE_ERROR, BIAS_ERROR = 0.04, 0.004, math.radians(0.1)  # that six leaning sides may leave; assumed
POSE_MS = 1800


def console() -> Console:
    return Console(file=io.StringIO(), width=300)


def text_of(shown: Console) -> str:
    assert isinstance(shown.file, io.StringIO)
    return shown.file.getvalue()


def lying(up: np.ndarray, offset: np.ndarray, gain: np.ndarray, rng: np.random.Generator) -> RestPose:
    """What a part with these errors measures when `up` points up in it, three degrees off."""
    leaning = up + 0.05 * rng.standard_normal(3)
    true = G * leaning / np.linalg.norm(leaning)
    forces = gain * true + offset + 0.033 * rng.standard_normal((300, 3))
    return pose_of(forces, 0.02 + 0.004 * rng.standard_normal((300, 3)))


@pytest.mark.parametrize("seed", range(12))
def test_errors_at_the_data_sheets_limits_come_out(seed: int) -> None:
    rng = np.random.default_rng(seed)
    offset, gain = 0.05 * 9.80665 * rng.choice([-1, 1], 3), 1.0 + 0.01 * rng.choice([-1, 1], 3)
    found = fit_errors([lying(up, offset, gain, rng) for up in SIDES], G, 24.0)
    assert found.offset == pytest.approx(offset, abs=0.02)
    assert found.scale * gain == pytest.approx(np.ones(3), abs=0.002)
    assert found.bias == pytest.approx(np.full(3, 0.02), abs=0.001)
    assert found.celsius == 24.0


def test_more_poses_than_needed_are_used() -> None:
    rng, offset = np.random.default_rng(4), np.array([0.3, -0.2, 0.4])
    ups = np.vstack([SIDES, np.array([(1, 1, 0), (0, 1, 1), (-1, 0, 1)]) / math.sqrt(2.0)])
    assert fit_errors([lying(up, offset, np.ones(3), rng) for up in ups], G, 24.0).offset == pytest.approx(
        offset, abs=0.02
    )


def test_poses_parts_and_settings_that_cannot_be() -> None:
    rng = np.random.default_rng(5)
    poses = [lying(up, np.zeros(3), np.ones(3), rng) for up in SIDES]
    check_unlike(poses[5], poses[:5])
    ring = [
        RestPose(G * np.array([math.cos(a), math.sin(a), 0.3]) / math.hypot(1.0, 0.3), np.zeros(3)) for a in range(6)
    ]
    half = [RestPose(G * np.array(up) / np.linalg.norm(up), np.zeros(3))
            for up in ((1, 0, 0), (0, 1, 0), (0, 0, 1), (-1, -1, 0), (1, 1, 1), (-1, 0, 1))]  # fmt: skip
    stretched = [lying(up, np.zeros(3), np.array([1.2, 1.0, 1.0]), rng) for up in SIDES]
    still, turning = np.tile([0.0, 0.0, G], (300, 1)), np.zeros((300, 3))
    turned = np.linspace(0.0, 0.2, 300)[:, None]
    slowly = G * np.hstack([np.sin(turned), np.zeros_like(turned), np.cos(turned)])
    refused: dict[str, Callable[[], object]] = {
        "too few poses": lambda: fit_errors(poses[:5], G, 24.0),
        "a pose that was there": lambda: check_unlike(lying(SIDES[2], np.zeros(3), np.ones(3), rng), poses[:5]),
        "poses of a ring": lambda: fit_errors(ring, G, 24.0),
        "poses of one half": lambda: fit_errors(half, G, 24.0),
        "a scale of no part": lambda: fit_errors(stretched, G, 24.0),
        "shaken": lambda: pose_of(still + 0.3 * rng.standard_normal((300, 3)), turning),
        "turned": lambda: pose_of(still, turning + 0.1 * rng.standard_normal((300, 3))),
        "turned slowly and evenly": lambda: pose_of(slowly, turning),
        "damaged": lambda: pose_of(np.full((300, 3), 0.2), turning),
        "too few values": lambda: pose_of(still[:50], turning[:50]),
        "no part answers": lambda: measure_poses(lambda _: [ProbeResult()], console()),
    }
    for line in ("scale_x = 0.0", "offset_y_m_s2 = 20.0", "bias_z_rad_s = -3.0"):
        refused[f"settings: {line}"] = partial(parse_settings, f"[foot_imu]\n{line}\n", "x")
    expect("calibrate accelerometers", {case: refusal(fit) for case, fit in refused.items()}, within=0.1)


class Boards:
    """Both boards with the real firmware, their parts on another side at each pose, in simulated time."""

    def __init__(self) -> None:
        self.parts = [
            LyingParts(np.random.default_rng([7, k]), name) for k, name in enumerate(("belt board", "foot board"))
        ]
        self.boards = [BoardProcess([str(TWIN), "--elf", str(ELF), "--seed", str(k)]) for k in (1, 2)]
        for board, kit, parts in zip(self.boards, ("2026", "foot"), self.parts, strict=True):
            board.fault(f"kit={kit}")
            board.send(encode(m.Identify(), 0) + encode(SUBSCRIBE, 1))
            board.advance(parts.rows(0, 2 * POSE_MS))
        self.listened = 0
        self.order = list(range(POSES))

    def listen(self, _: str) -> list[ProbeResult]:
        pose, found = self.order[self.listened], []
        self.listened += 1
        for board, parts in zip(self.boards, self.parts, strict=True):
            board.advance(parts.rows(pose, 200))  # what was under way
            running = _Probe(SimpleNamespace(notices=[], send=lambda *_: None), {BOARD: "x"}, check_gyros=False)  # type: ignore[arg-type]
            for t_ns, sent in board.advance(parts.rows(pose, POSE_MS)):
                running._receive(Chunk(BOARD, t_ns, sent))
            found.append(running.result)
        return found


@pytest.fixture
def boards() -> Iterator[Boards]:
    made = Boards()
    yield made
    for board in made.boards:
        board.close()


@needs_twin
def test_all_parts_of_both_boards_are_calibrated_through_the_real_firmware(boards: Boards) -> None:
    found = measure_poses(boards.listen, console())
    assert list(found) == ["thigh", "calf", "belt", "foot"]
    for k, place in enumerate(found):
        parts, row = (boards.parts[1], 0) if place == "foot" else (boards.parts[0], k)
        assert found[place].offset == pytest.approx(parts.offset_m_s2[row], abs=OFFSET_ERROR)
        assert found[place].scale * parts.gain[row] == pytest.approx(np.ones(3), abs=SCALE_ERROR)
        assert found[place].bias == pytest.approx(parts.bias_rad_s[row], abs=BIAS_ERROR)
        assert found[place].celsius == pytest.approx(24.0, abs=5.0)


@needs_twin
def test_a_pose_that_was_there_is_asked_for_again_and_at_last_refused(boards: Boards) -> None:
    shown = console()
    boards.order = [0, 1, 1, 2, 3, 4, 5]
    measure_poses(boards.listen, shown)
    assert text_of(shown).count("lies as in pose 2") == 1
    assert text_of(shown).count("Pose 6 of 6") == 1
    boards.order, boards.listened = [0] * 10, 0
    with pytest.raises(EchostepError, match="thigh: lies as in pose 1"):
        measure_poses(boards.listen, console())
    assert boards.listened == 1 + TRIES


def test_the_foots_samples_are_corrected() -> None:
    """As the tracker reads them: live, and in a replay from the settings that the recording keeps."""
    errors = ImuSettings(0.3, -0.2, 0.1, 1.01, 0.99, 1.0, 0.01, 0.02, -0.03)
    sent = encode(m.Foot(0, 0, 82, 0, -82, 100, -200, 1024), 0)
    bare, corrected = (FootBoardReader(e).feed(sent) for e in (None, errors))
    assert corrected.accel == pytest.approx((bare.accel - errors.offset) * errors.scale)
    assert corrected.gyro == pytest.approx(bare.gyro - errors.bias)
    assert bare.accel[0] == pytest.approx(ICM20649_M_S2 * np.array([100, -200, 1024]))


@contextmanager
def foot_on_a_pseudo_terminal() -> Iterator[Any]:
    """A foot board in real time."""
    made = importlib.import_module("twin.run").LyingBoard(3, foot=True)

    def step() -> None:
        made.advance()
        time.sleep(0.005)

    with closing(made.board), playing(step):
        yield made


@pytest.mark.long
@needs_twin
def test_the_command_writes_settings_that_the_tracker_reads(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = tmp_path / "me.toml"
    out.write_text("[foot]\nheight_m = 0.09\n")
    with foot_on_a_pseudo_terminal() as made:

        def turn_the_box(_: Console) -> None:
            made.pose += 1

        monkeypatch.setattr(calibrate, "_wait", turn_the_box)
        done = echostep("calibrate", "accelerometers", "--foot", made.board.port, "--out", out)
    assert done.returncode == 0, done.stderr
    assert "Pose 1 of 6: lay the boxes of belt, thigh, calf and foot on another side" in done.stdout
    assert "Pose 6 of 6: lay the box of the foot on another side" in done.stdout
    written = parse_settings(out.read_text(), "me.toml")
    assert written.foot.height_m == 0.09
    assert written.imus.foot.offset == pytest.approx(made.parts.offset_m_s2[0], abs=OFFSET_ERROR)
    assert written.belt_imu == Settings().belt_imu


@given(arrays(np.float64, (7, 3), elements=st.floats(-300.0, 300.0)))
@settings(max_examples=60, deadline=None)
def test_any_forces_give_errors_of_a_part_or_words(forces: np.ndarray) -> None:
    """Warnings are errors in the tests: no division by zero, nothing that is not a number."""
    poses = [RestPose(force, np.zeros(3)) for force in forces if np.linalg.norm(force) > 5.0]
    with suppress(ValueError):
        found = fit_errors(poses, G, 24.0)
        assert np.isfinite([found.offset, found.scale]).all()
