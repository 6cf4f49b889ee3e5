# SPDX-License-Identifier: MIT
"""`echostep import`: the tracker gets the samples of the file, a gap is a gap; a true path beside it is carried and compared by one rule."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from ezdxf.filemanagement import new

import echostep
from command_line import echostep as run
from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep.localization import Estimate, digest
from echostep.offline.imu_csv import Imu
from echostep.plan import Pose, load_plan
from echostep.ports.chunks import MTX
from echostep.recording import open_recording
from echostep.xsens import MtxReader
from echostep_app.offline.importing import import_imu, rate_of
from echostep_app.page.elements.scene import TruePath, TruePosition
from echostep_app.scorecard.truth import FIELD, load_truth, recorded_truth
from foot.foot_walks import walking
from offline.imu_files import hall, write


@pytest.fixture(scope="module")
def walk() -> Imu:
    """A simulated walk of twelve steps."""
    return Imu(*walking(12))


def test_a_recording_holds_the_samples_and_the_gap(walk: Imu, tmp_path: Path) -> None:
    kept = np.r_[0:300, 340 : len(walk.t_s)]
    import_imu(Imu(walk.t_s[kept] + 7.0, walk.accel[kept], walk.gyro[kept]), "imu.csv", tmp_path / "walk.mcap", {})
    reader, recording = MtxReader(), open_recording(tmp_path / "walk.mcap")
    batch = reader.feed_batch(b"".join(chunk.data for chunk in recording.chunks() if chunk.port == MTX))
    assert np.allclose(batch.accel, walk.accel[kept], rtol=1e-6, atol=1e-6)
    assert np.allclose(batch.gyro, walk.gyro[kept], rtol=1e-6, atol=1e-6)
    assert reader.counts.lost == 40
    with pytest.raises(EchostepError, match="exists"):
        import_imu(walk, "imu.csv", tmp_path / "walk.mcap", {})


def test_two_commands_track_a_file_on_a_plan(walk: Imu, tmp_path: Path) -> None:
    file, out, plan = tmp_path / "imu.csv", tmp_path / "walk.mcap", hall(tmp_path / "plan.json")
    write(file, walk)
    imported = run("import", file, "-o", out)
    assert imported.returncode == 0, imported.stderr
    tracked = run("replay", out, "--plan", plan, "--start", "1,2,90", "--headless", "--out", tmp_path)
    assert tracked.returncode == 0, tracked.stderr
    assert "imported from imu.csv" in tracked.stdout
    assert (tmp_path / "track.png").exists()
    first, second = (echostep.replay(out, plan, start=echostep.plan.Pose(1.0, 2.0, np.pi / 2)) for _ in range(2))
    assert digest(first.estimates) == digest(second.estimates)
    refused = run("map", out, "-o", tmp_path / "drawn.json")
    assert refused.returncode == 2
    assert "no echo in it: it is a foot's alone, and walls are drawn from echoes" in refused.stderr
    end = first.estimates[-1]
    assert end.x_m == pytest.approx(1.0, abs=0.5)
    assert end.y_m > 10.0


@pytest.mark.process
@pytest.mark.parametrize(("plan", "start", "said"), [
    ("plan.json", (), "No start is known, so the walk is sought anywhere: --start X,Y,DEG gives it."),
    ("plan.json", ("--start", "1,2,0"), "the steps did not fit the plan: are start and heading right?"),
    ("plan.json", ("--start", "30,2,90"), "--start 30,2,90: it is outside the building: the nearest possible place is 8."),
    ("plan.dxf", ("--start", "1,2,90"), "echostep plan import plan.dxf -o plan.json --units "),
])  # fmt: skip
def test_what_a_newcomer_does_wrong_is_told(
    walk: Imu, tmp_path: Path, plan: str, start: tuple[str, ...], said: str
) -> None:
    write(tmp_path / "imu.csv", walk)
    hall(tmp_path / "plan.json")
    drawing = new(units=0)
    for wall in ((0, 0, 24, 0), (24, 0, 24, 12), (24, 12, 0, 12), (0, 12, 0, 0)):
        drawing.modelspace().add_line(wall[:2], wall[2:], {"layer": "A-WALL"})
    drawing.saveas(tmp_path / "plan.dxf")
    done = run("foot", "imu.csv", "--plan", plan, *start, cwd=tmp_path)
    assert said in done.stdout + done.stderr
    assert done.returncode in (0, 2)
    assert (tmp_path / "out").exists() == (done.returncode == 0)  # nothing is left of what was refused


def test_times_in_milliseconds_and_gaps_give_the_rate() -> None:
    t_s = np.round(np.arange(3000) / 204.8, 3)
    assert rate_of(np.delete(t_s, np.s_[800:1000])) == pytest.approx(204.8, rel=1e-3)


def test_ranges_pressure_and_legs_beside_are_recorded_and_used(walk: Imu, tmp_path: Path) -> None:
    """A corridor 4 m wide, walked 0.7 m right of the middle, from a start that is known to 1 m: the echoes find the side."""
    plan = hall(tmp_path / "plan.json", 2)
    write(tmp_path / "imu.csv", walk)
    t_s = np.repeat(walk.t_s[:: len(walk.t_s) // 60], 2)
    direction, range_m = np.tile([90.0, -90.0], len(t_s) // 2), np.tile([2.7, 1.3], len(t_s) // 2)
    table = {"ranges": ("t_s,direction_deg,range_m", [t_s, direction, range_m])}
    table["pressure"] = ("t (ms),pressure_pa (hPa)", [1e3 * t_s, 1013.0 + 0.01 * (np.arange(len(t_s)) % 3)])
    swing = np.sin(2.0 * np.pi * walk.t_s)
    table["legs"] = ("t_s,thigh_rad_s,shank_rad_s", [walk.t_s, swing, 2.0 * swing**3])
    for name, (header, columns) in table.items():
        rows = np.column_stack(columns)
        np.savetxt(tmp_path / f"{name}.csv", rows, delimiter=",", header=header, comments="", fmt="%.9g")
    (tmp_path / "rangers.toml").write_text("[echo]\nmaximum_m = 5.0\n")
    beside = [word for name in table for word in (f"--{name}", f"{name}.csv")]
    made = run("import", "imu.csv", "-o", "walk.mcap", *beside, "--settings", "rangers.toml", cwd=tmp_path)
    assert made.returncode == 0, made.stderr
    assert "messages of ranges, pressure, legs, 0 left out" in made.stdout
    decoded = list(echostep.read_capture(tmp_path / "walk.mcap"))
    pings = [message for message in decoded if isinstance(message, echostep.messages.Ping)]
    assert [round(0.5e-6 * ping.time_of_flight_us * 343.2, 2) for ping in pings[:2]] == [2.7, 1.3]
    (first, *_) = [message for message in decoded if isinstance(message, echostep.messages.Pressure)]
    assert first.pressure == 4 * 101_300
    start = echostep.localization.Start(echostep.plan.Pose(0.0, 2.0, np.pi / 2), 1.0, 0.05)
    end = echostep.replay(tmp_path / "walk.mcap", plan, start=start).estimates[-1]
    assert end.x_m == pytest.approx(0.7, abs=0.15)
    for lines, said in (
        ("0,0,1\n1,0,1", "direction_deg 0: expected one ranger to the left (90)"),
        ("0,90,150\n1,-90,250", "range_m is 200: metres up to 11 are expected"),
        ("1e6,90,1\n1e6,-90,2", "nothing in it from "),
    ):
        (tmp_path / "ranges.csv").write_text(f"t_s,direction_deg,range_m\n{lines}\n")
        refused = run("import", "imu.csv", "-o", "other.mcap", *beside, cwd=tmp_path)
        assert f"ranges.csv: {said}" in refused.stderr


def test_arrays_of_any_length_are_tracked_as_the_recording_is(walk: Imu, tmp_path: Path) -> None:
    file, plan = tmp_path / "walk.mcap", hall(tmp_path / "plan.json")
    import_imu(walk, "imu.csv", file, {})
    start = echostep.plan.Pose(1.0, 2.0, np.pi / 2)
    recorded = echostep.replay(file, plan, start=start).estimates

    def tracked(accel: Floats, gyro: Floats) -> list[Estimate]:
        tracker = echostep.Tracker(echostep.plan.load_plan(plan), start, echostep.Settings.of_imu(rate_of(walk.t_s)))
        return [
            estimate
            for k in np.array_split(np.arange(len(walk.t_s)), 7)
            for estimate in tracker.feed_samples(walk.t_s[k], accel[k], gyro[k])
        ]

    rounded = (each.astype(np.float32).astype(np.float64) for each in (walk.accel, walk.gyro))  # as they are recorded
    assert digest(tracked(*rounded)) == digest(recorded)
    exact = tracked(walk.accel, walk.gyro)
    assert [e.t_s for e in exact] == pytest.approx([e.t_s for e in recorded])
    places, again = (np.array([(e.x_m, e.y_m) for e in estimates]) for estimates in (exact, recorded))
    assert places == pytest.approx(again, abs=0.05)
    tracker = echostep.Tracker(echostep.plan.load_plan(plan), start)
    with pytest.raises(EchostepError, match=r"must be \(n,\)"):
        tracker.feed_samples(walk.t_s, walk.accel[:, :2], walk.gyro)


BEGIN_S = 7.0  # of the file's times
START = "1,2,90"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A simulated walk of twelve steps along y, its times from 7 s on; the truth beside it at 100 Hz, and at points 2 s apart."""
    folder = tmp_path_factory.mktemp("truth")
    imu = Imu(*walking(12))
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
    at_once = run("foot", folder / "imu.csv", *on_plan, "--truth", folder / f"{truth}.csv", "--out", tmp_path / "a")
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
    told = run("score", tmp_path / "walk.mcap", "--plan", folder / "plan.json").stdout
    assert told.startswith("No start is known, so the walk is sought anywhere")
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
