# SPDX-License-Identifier: MIT
"""The wheel works on its own: nothing of the clone is needed. `make wheel` goes the whole way, with dependencies fetched and a demo."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest

from board_runs import ROOT
from command_line import echostep
from foot.foot_walks import MANNERS, course, samples
from release import wheel as wheels
from walks import DEMO

pytestmark = pytest.mark.process


@pytest.fixture(scope="module")
def fresh(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, str]]:
    """`bin` of an environment with the wheel in it, and surroundings without compilers."""
    folder = tmp_path_factory.mktemp("wheel")
    try:
        built = [wheels.build(folder, ring) for ring in ("core", "app")]
    except subprocess.CalledProcessError as error:
        if "hatchling" in error.stderr:
            pytest.skip("hatchling is not installed in this environment")
        raise
    programs = wheels.environment(folder / "fresh", built, borrow=True)
    return programs, wheels.environment_variables(programs, folder)


@pytest.mark.long
def test_an_installed_wheel_decodes_and_looks_into_recordings(
    fresh: tuple[Path, dict[str, str]], tmp_path: Path
) -> None:
    programs, env = fresh
    where = wheels.run([programs / "python", "-c", "import echostep; print(echostep.__file__)"], env, tmp_path)
    assert str(programs.parent) in where
    decoded = wheels.run([programs / "echostep", "decode", ROOT / "tests/captures/board.bin"], env, tmp_path)
    expected = (ROOT / "tests/captures/board.jsonl").read_text().splitlines()
    assert [json.loads(line) for line in decoded.splitlines()] == [json.loads(line) for line in expected]
    told = wheels.run([programs / "echostep", "info", ROOT / "tests/captures/walk.mcap"], env, tmp_path)
    assert told.rstrip().endswith("whole")


def test_an_installed_wheel_has_what_the_demo_needs(fresh: tuple[Path, dict[str, str]], tmp_path: Path) -> None:
    programs, env = fresh
    code = (
        "from importlib.resources import files, as_file\n"
        "from echostep.plan import load_plan\n"
        "from echostep_simulation.scenario import demo_scenario\n"
        "with as_file(files('echostep') / 'plans' / 'demo.json') as path: print(len(load_plan(path).levels[0].walls))"
    )
    assert int(wheels.run([programs / "python", "-c", code], env, tmp_path)) > 10
    assert "Track a simulated walk" in wheels.run([programs / "echostep", "demo", "--help"], env, tmp_path)


def test_an_installed_wheel_holds_its_data_and_nothing_else(fresh: tuple[Path, dict[str, str]]) -> None:
    programs, _ = fresh
    (packages,) = programs.parent.glob("lib/python*/site-packages")
    names = ("firmware/echostep.hex", "firmware/99-echostep.rules", "page/static/index.html")
    for name in ("echostep/plans/demo.json", *(f"echostep_app/{name}" for name in names)):
        assert (packages / name).stat().st_size > 100, name
    for record in packages.glob("echostep*.dist-info/RECORD"):
        assert "tests/" not in record.read_text()


@pytest.fixture(scope="module")
def core(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, str]]:
    """The same with the core alone."""
    pytest.importorskip("hatchling")
    folder = tmp_path_factory.mktemp("core")
    programs = wheels.environment(folder / "fresh", [wheels.build(folder, "core")], borrow=True)
    return programs, wheels.environment_variables(programs, folder) | {"HOME": str(Path.home())}


@pytest.mark.long
def test_the_core_alone_decodes_tracks_and_navigates_a_foot(core: tuple[Path, dict[str, str]], tmp_path: Path) -> None:
    programs, env = core
    program, walk = programs / "echostep", ROOT / "tests/captures/walk.mcap"
    decoded = wheels.run([program, "decode", ROOT / "tests/captures/board.bin"], env, tmp_path)
    assert decoded == (ROOT / "tests/captures/board.jsonl").read_text()
    told = wheels.run(
        [program, "replay", walk, "--plan", DEMO, "--headless", "--out", tmp_path / "core"], env, tmp_path
    )
    whole = echostep("replay", walk, "--plan", DEMO, "--headless", "--out", tmp_path / "whole")
    assert told.splitlines()[0] in whole.stdout.splitlines()  # number and digest of the estimates
    assert (tmp_path / "core/track.csv").read_bytes() == (tmp_path / "whole/track.csv").read_bytes()
    t_s, accel, gyro = samples(course(MANNERS["walking"], steps=6), 100, rng=np.random.default_rng(1))
    rows = np.column_stack([t_s, accel, gyro])
    np.savetxt(tmp_path / "imu.csv", rows, delimiter=",", header="t_s,ax,ay,az,gx,gy,gz", comments="")
    assert "6 steps" in wheels.run([program, "foot", tmp_path / "imu.csv"], env, tmp_path)


def test_the_core_alone_names_a_mistake_in_one_line(core: tuple[Path, dict[str, str]], tmp_path: Path) -> None:
    programs, env = core
    done = subprocess.run(
        [programs / "echostep", "foot", "no.csv"], env=env, cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert done.stderr.startswith("echostep: no.csv: cannot read")
    assert "echostep[app]" in wheels.run([programs / "echostep", "--help"], env, tmp_path)
