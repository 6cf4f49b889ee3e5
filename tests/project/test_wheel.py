# SPDX-License-Identifier: MIT
"""The wheels: metadata as PyPI shows it, CITATION.cff; they work on their own, nothing of the clone is needed."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tomllib
import zipfile
from email import message_from_string
from email.message import Message
from pathlib import Path
from urllib.parse import urlparse

import numpy as np
import pytest
import yaml

from board_runs import ROOT
from command_line import echostep
from foot.foot_walks import walking
from release import wheel as wheels
from waiting import ran
from walks import DEMO

pytestmark = pytest.mark.process
PUBLIC = "https://example.org/owner/echostep"
PROJECT = tomllib.loads((ROOT / "host/core/pyproject.toml").read_text())["project"]


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel with a public address, as `make wheel URL=...` builds it."""
    pytest.importorskip("hatchling")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ECHOSTEP_URL", PUBLIC)
        return wheels.build(tmp_path_factory.mktemp("published"), "core")


def metadata(wheel: Path) -> Message:
    with zipfile.ZipFile(wheel) as archive:
        name = next(name for name in archive.namelist() if name.endswith(".dist-info/METADATA"))
        return message_from_string(archive.read(name).decode())


@pytest.mark.long
def test_pypi_takes_the_wheel_without_a_warning(built: Path) -> None:
    pytest.importorskip("twine")
    done = ran([sys.executable, "-m", "twine", "check", "--strict", built])
    assert done.returncode == 0, done.stdout + done.stderr
    assert "PASSED" in done.stdout


def test_the_metadata_is_complete(built: Path) -> None:
    about = metadata(built)
    assert about["Author"] == "The echostep authors"
    assert about["License-Expression"] == "MIT"
    assert about["License-File"] == "LICENSE"
    assert len(about.get_all("Classifier", [])) > 8
    assert len(about["Keywords"].split(",")) > 3
    links = dict(line.split(", ", 1) for line in about.get_all("Project-URL", []))
    assert {"Homepage", "Source", "Issues", "Documentation", "Changelog"} <= set(links)
    assert all(url.startswith(PUBLIC) for url in links.values())


def test_links_and_pictures_of_the_page_on_pypi_are_absolute_and_lead_somewhere(built: Path) -> None:
    text = metadata(built).get_payload()
    assert isinstance(text, str)
    targets = re.findall(r"(!?)\[[^]]*\]\(([^)#]+)", text)
    assert any(is_picture for is_picture, _ in targets)
    for is_picture, target in targets:
        assert urlparse(target).scheme == "https", target
        if target.startswith(PUBLIC):
            kind, branch, path = target.removeprefix(PUBLIC + "/").split("/", 2)
            assert (kind, branch) == ("raw" if is_picture else "blob", "main"), target
            assert (ROOT / path).exists(), target


def test_the_licence_that_the_package_takes_along_is_the_projects(built: Path) -> None:
    """A copy, because an archive of the sources cannot hold a link that leads out of it."""
    for ring in ("core", "app"):
        assert not (ROOT / f"host/{ring}/LICENSE").is_symlink()
        assert (ROOT / f"host/{ring}/LICENSE").read_text() == (ROOT / "LICENSE").read_text()
    with zipfile.ZipFile(built) as archive:
        name = next(name for name in archive.namelist() if name.endswith("licenses/LICENSE"))
        assert archive.read(name) == (ROOT / "LICENSE").read_bytes()


def test_without_a_public_address_none_is_invented(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("hatchling")
    monkeypatch.delenv("ECHOSTEP_URL", raising=False)
    about = metadata(wheels.build(tmp_path, "app"))
    assert about.get_all("Project-URL") is None
    assert about.get_payload() == (ROOT / "host/README.md").read_text()


def test_the_citation_is_of_this_version() -> None:
    citation = yaml.safe_load((ROOT / "host/CITATION.cff").read_text())
    assert {"cff-version", "message", "title", "authors"} <= set(citation)
    assert citation["version"] == PROJECT["version"]
    assert citation["license"] == PROJECT["license"]
    changes = (ROOT / "host/CHANGELOG.md").read_text()
    assert f"## {citation['version']} ({citation['date-released']})" in changes
    assert [work["year"] for work in citation["references"]] == [2011, 2008, 2010]


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
    blas = {
        name: value for name, value in os.environ.items() if name.startswith("OPENBLAS_")
    }  # sums as here, bit for bit
    return programs, wheels.environment_variables(programs, folder) | {"HOME": str(Path.home())} | blas


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
    rows = np.column_stack(walking(6))
    np.savetxt(tmp_path / "imu.csv", rows, delimiter=",", header="t_s,ax,ay,az,gx,gy,gz", comments="")
    assert "6 steps" in wheels.run([program, "foot", tmp_path / "imu.csv"], env, tmp_path)


def test_the_core_alone_names_a_mistake_in_one_line(core: tuple[Path, dict[str, str]], tmp_path: Path) -> None:
    programs, env = core
    done = ran([programs / "echostep", "foot", "no.csv"], env=env, cwd=tmp_path)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert done.stderr.startswith("echostep: no.csv: cannot read")
    assert "echostep[app]" in wheels.run([programs / "echostep", "--help"], env, tmp_path)
