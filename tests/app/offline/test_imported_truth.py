# SPDX-License-Identifier: MIT
"""`echostep import --truth`: the recording carries the true path, and replay, score, foot and the page compare with it by one rule."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

import echostep
from command_line import echostep as run
from echostep.errors import EchostepError
from echostep.localization import digest
from echostep.offline.imu_csv import Imu
from echostep.plan import Pose, load_plan
from echostep.recording import open_recording
from echostep_app.page.elements.scene import TruePath, TruePosition
from echostep_app.scorecard.truth import FIELD, load_truth, recorded_truth
from foot.foot_walks import MANNERS, course, samples
from offline.imu_files import hall, write

BEGIN_S = 7.0  # of the file's times
START = "1,2,90"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A simulated walk of twelve steps along y, its times from 7 s on; the truth beside it at 100 Hz, and at points 2 s apart."""
    folder = tmp_path_factory.mktemp("truth")
    imu = Imu(*samples(course(MANNERS["walking"], steps=12), 100, rng=np.random.default_rng(1)))
    imu = Imu(imu.t_s + BEGIN_S, imu.accel, imu.gyro)
    write(folder / "imu.csv", imu)
    hall(folder / "plan.json")
    assert run("import", "imu.csv", "-o", "bare.mcap", cwd=folder).returncode == 0
    walked = echostep.replay(folder / "bare.mcap", folder / "plan.json", start=Pose(1.0, 2.0, np.pi / 2)).estimates
    at = np.array([(e.t_s + imu.t_s[0], e.x_m + 0.3, e.y_m) for e in walked])
    for name, t_s in (("path", imu.t_s), ("points", np.arange(9.0, 20.0, 2.0))):
        rows = np.column_stack([t_s, *(np.interp(t_s, at[:, 0], at[:, k]) for k in (1, 2))])
        np.savetxt(folder / f"{name}.csv", rows, delimiter=";", header="time;east;north", comments="", fmt="%.4f")
    return folder


@pytest.mark.parametrize("truth", ["path", "points"])
def test_replay_score_and_foot_compare_with_the_recorded_truth(folder: Path, tmp_path: Path, truth: str) -> None:
    made = run("import", "imu.csv", "-o", tmp_path / "walk.mcap", "--truth", f"{truth}.csv", cwd=folder)
    assert made.returncode == 0, made.stderr
    on_plan = ("--plan", folder / "plan.json", "--start", START)
    tracked = run("replay", tmp_path / "walk.mcap", *on_plan, "--headless", "--out", tmp_path)
    at_once = run(
        "foot", folder / "imu.csv", *on_plan, "--truth", folder / f"{truth}.csv", "--out", tmp_path / "a/t.csv"
    )
    rmse = [re.findall(r"RMSE ([\d.]+) m", done.stdout) for done in (tracked, at_once)]
    assert rmse == [["0.30"], ["0.30"]], tracked.stdout + at_once.stdout + at_once.stderr
    scored = [
        json.loads(run("score", *arguments, "--json").stdout)["tracks"][0]["horizontal"]["rms_m"]
        for arguments in (
            (tmp_path / "walk.mcap", *on_plan),
            (tmp_path / "track.csv", "--truth", tmp_path / "walk.mcap", "--plan", folder / "plan.json"),
        )
    ]
    assert scored == pytest.approx([0.3, 0.3], abs=0.002)
    bare, walk = (
        echostep.replay(each, folder / "plan.json", start=Pose(1.0, 2.0, np.pi / 2))
        for each in (folder / "bare.mcap", tmp_path / "walk.mcap")
    )
    assert digest(bare.estimates) == digest(walk.estimates)


def test_the_page_shows_the_recorded_truth(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "truth.csv").write_text("t_s,x_m,y_m,z_m\n7.0,1,2,0\n17.005,3,4,3\n")
    assert (
        run("import", folder / "imu.csv", "-o", tmp_path / "walk.mcap", "--truth", tmp_path / "truth.csv").returncode
        == 0
    )
    tree = json.loads((folder / "plan.json").read_text())
    tree["levels"].append({"name": "1", "height_m": 3.0, "walls": tree["levels"][0]["walls"]})
    (tmp_path / "house.json").write_text(json.dumps(tree))
    plan = load_plan(tmp_path / "house.json")
    path = TruePath.of(load_truth(tmp_path / "walk.mcap", plan), plan)
    assert path is not None
    assert [path.at(t_s) for t_s in (-1.0, 20.0)] == [TruePosition(1.0, 2.0, 0), TruePosition(3.0, 4.0, 1)]
    assert TruePath.of(load_truth(folder / "path.csv", plan), plan) is None  # on which storey is not known


def test_a_truth_that_cannot_be_the_walks_is_refused(folder: Path, tmp_path: Path) -> None:
    for name, rows, said in (
        (
            "other.csv",
            "1700000000,1,2\n1700000001,1,3\n",
            r"other\.csv: no row from 7\.\d* to 2\d\.\d* s, .* imu\.csv: both need the same clock",
        ),
        ("far.csv", "8,5000000,2\n9,5000000,3\n", r"far\.csv: .* beyond 1e\+06 m: metres of the plan are expected"),
        ("none.csv", "", r"none\.csv: no line of numbers"),
    ):
        (tmp_path / name).write_text(f"t_s,x,y\n{rows}")
        refused = run("import", folder / "imu.csv", "-o", tmp_path / "w.mcap", "--truth", tmp_path / name)
        assert refused.returncode == 2
        assert re.search(said, refused.stderr), refused.stderr
        assert not (tmp_path / "w.mcap").exists()
    refused = run("score", folder / "bare.mcap", "--plan", folder / "plan.json")
    assert "bare.mcap: no true path in it: give one with --truth FILE" in refused.stderr


@pytest.mark.parametrize(
    "field", ["[" * 9999, "{}", '{"t_s":[1],"x_m":[1,2],"y_m":[1]}', '{"t_s":[2,1],"x_m":[1,2],"y_m":[1,1]}']
)
def test_a_damaged_recorded_truth_is_one_error(folder: Path, field: str) -> None:
    recording = open_recording(folder / "bare.mcap")
    recording.metadata[FIELD] = field
    with pytest.raises(EchostepError, match=r"bare\.mcap: its true path is damaged: give one with --truth FILE"):
        recorded_truth(recording, None)


def test_a_long_truth_is_thinned_and_told(folder: Path, tmp_path: Path) -> None:
    """A metadata record of a megabyte is no longer read as one: 200,000 rows do not fit."""
    t_s = np.linspace(7.0, 20.0, 200_000)
    np.savetxt(
        tmp_path / "t.csv", np.column_stack([t_s, t_s, t_s]), delimiter=",", header="t_s,x,y", comments="", fmt="%.6f"
    )
    made = run("import", folder / "imu.csv", "-o", tmp_path / "walk.mcap", "--truth", tmp_path / "t.csv")
    assert re.search(r"truth: \d+ rows of t\.csv, every \d+th", made.stdout), made.stdout
    truth = load_truth(tmp_path / "walk.mcap", None)
    assert 10_000 < len(truth.t_s) < 50_000
    assert open_recording(tmp_path / "walk.mcap").damage() == []
