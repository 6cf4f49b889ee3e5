# SPDX-License-Identifier: MIT
"""The core works alone: what is optional is missing from one function at a time, and named with the extra that brings it."""

from __future__ import annotations

import ast
import itertools
import json
import os
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from importlib.metadata import packages_distributions
from pathlib import Path
from unittest import mock

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from board_runs import ROOT
from command_line import PROGRAM, echostep
from echostep_app import cli
from echostep_app.extras import EXTRAS
from project.brought_files import foot as foot_file
from waiting import ran
from walks import DEMO

pytestmark = pytest.mark.process
SIMULATION = ROOT / "host/simulation/echostep_simulation"  # in the app's wheel
RINGS = {"core": [ROOT / "host/core/echostep"], "app": [SIMULATION, ROOT / "host/app/echostep_app"]}
PROJECTS = {ring: tomllib.loads((ROOT / f"host/{ring}/pyproject.toml").read_text())["project"] for ring in RINGS}
REQUIRED = {ring: project["dependencies"] for ring, project in PROJECTS.items()}
OPTIONAL = PROJECTS["app"]["optional-dependencies"]
FOR_DEVELOPERS = {"dev", "bench", "cluster"}
OWNERS = packages_distributions()
CAPTURES = ROOT / "tests/captures"
PLAN = ("--plan", DEMO)
WALK = CAPTURES / "walk.mcap"


def imports(texts: list[str]) -> set[str]:
    """The packages of requirements, as they are imported."""
    names = {canonicalize_name(Requirement(text).name) for text in texts}
    return {
        package for package, owners in OWNERS.items() if names & {canonicalize_name(o) for o in owners} and package.isidentifier()
    }  # fmt: skip


def third_party(path: Path) -> Iterator[str]:
    """The packages that a module imports, at its top or in a function."""
    for node in ast.walk(ast.parse(path.read_text())):
        names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
        yield from (
            {name.partition(".")[0] for name in names}
            - sys.stdlib_module_names
            - {"echostep", "echostep_simulation", "echostep_app", "__future__"}
        )


def test_the_table_is_that_of_pyproject() -> None:
    parts = {extra: texts for extra, texts in OPTIONAL.items() if extra not in {*FOR_DEVELOPERS, "all"}}
    for package, extra in EXTRAS.items():
        assert package in imports(parts[extra]), package
    assert {r.name for texts in parts.values() for r in map(Requirement, texts)} == {
        name for package in EXTRAS for name in OWNERS[package]
    }
    assert not imports([*REQUIRED["core"], *REQUIRED["app"]]) & set(EXTRAS)


def test_all_is_every_extra_but_the_studies() -> None:
    (everything,) = map(Requirement, OPTIONAL["all"])
    assert everything.extras == set(OPTIONAL) - FOR_DEVELOPERS - {"all"}


def test_each_extra_of_the_app_is_one_of_the_core_under_its_name() -> None:
    """So that one name is installed: pip install 'echostep[page]'."""
    extras = {extra: texts for extra, texts in PROJECTS["core"]["optional-dependencies"].items() if extra != "studies"}
    assert extras.pop("app") == ["echostep-app[all]"]
    assert extras == {extra: [f"echostep-app[{extra}]"] for extra in OPTIONAL if extra not in FOR_DEVELOPERS}


@pytest.mark.slow
def test_every_import_is_required_or_has_an_extra() -> None:
    core, app = (imports(REQUIRED[ring]) for ring in RINGS)
    assert {"numpy", "lz4"} <= core
    assert "serial" in app
    for ring, required in (("core", core), ("app", core | app)):
        found = {
            package: path for folder in RINGS[ring] for path in folder.rglob("*.py") for package in third_party(path)
        }
        assert {
            name: path for name, path in found.items() if name not in required | set(EXTRAS) | {"gaitmap"}
        } == {}  # its users have it
        assert imports(REQUIRED[ring]) <= set(found) | {"echostep"}, "required, but nothing imports it"


@pytest.mark.slow
def test_no_kernel_multiplies_matrices_without_saying_so() -> None:
    """A product in a kernel needs the BLAS of scipy."""
    for path in (path for folder in itertools.chain(*RINGS.values()) for path in folder.rglob("*.py")):
        for function in ast.walk(ast.parse(text := path.read_text())):
            if isinstance(function, ast.FunctionDef) and any(
                "kernel" in ast.unparse(d) for d in function.decorator_list
            ):
                products = [n for n in ast.walk(function) if isinstance(getattr(n, "op", None), ast.MatMult)]
                called = {ast.unparse(n.func) for n in ast.walk(function) if isinstance(n, ast.Call)}
                if products or any(name == "np.dot" or name.startswith("np.linalg.") for name in called):
                    assert "import scipy" in text or 'scipy")' in text, f"{path}: {function.name}"


@pytest.fixture(scope="module")
def core(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Surroundings of a process, and of those that it starts, in which no optional package can be imported."""
    folder = tmp_path_factory.mktemp("core")
    (folder / "sitecustomize.py").write_text(f"import sys\nsys.modules.update(dict.fromkeys({list(EXTRAS)}))\n")
    return os.environ | {"PYTHONPATH": str(folder)}


def run(core: dict[str, str], folder: Path, *words: object) -> subprocess.CompletedProcess[str]:
    """An echostep command in such a process."""
    command = [*PROGRAM, *map(str, words)]
    return ran(command, env=core, cwd=folder)


def test_importing_loads_nothing_and_decoding_little(core: dict[str, str]) -> None:
    code = f"""
import json, sys
import echostep
before = list(sys.modules)
frames = list(echostep.read_capture({str(CAPTURES / "board.bin")!r}))
print(json.dumps([before, list(sys.modules), len(frames)]))
"""
    done = subprocess.run([sys.executable, "-c", code], env=core, capture_output=True, text=True, check=True)
    before, after, frames = json.loads(done.stdout)
    own = {name.partition(".")[0] for name in before} - set(EXTRAS)
    assert not own & imports(REQUIRED["core"])
    loaded = {name.partition(".")[0] for name in after} & imports(REQUIRED["core"])
    assert loaded == {"cobs", "lz4", "mcap", "numba", "numpy", "zstandard"}
    assert frames > 1000


@pytest.mark.long
def test_the_core_tracks_a_walk_and_says_what_it_leaves_out(core: dict[str, str], tmp_path: Path) -> None:
    words = ("replay", CAPTURES / "walk.mcap", "--plan", DEMO)
    done = run(core, tmp_path, *words, "--out", "core")
    assert done.returncode == 0, done.stderr
    assert (
        "No page is served: the page needs starlette, which is not installed: pip install 'echostep[page]'"
        in done.stderr
    )
    assert "track.png is left out: a picture needs matplotlib" in done.stdout
    assert [path.name for path in (tmp_path / "core").iterdir()] == ["track.csv"]
    foot_file(tmp_path / "imu.csv")
    for other in (
        ("decode", CAPTURES / "board.bin"),
        ("info", WALK),
        ("foot", "imu.csv"),
        ("replay", WALK, "--headless", "--out", "bare"),
    ):
        done = run(core, tmp_path, *other)
        assert done.returncode == 0, done.stderr
    echostep(*words, "--headless", "--out", tmp_path / "whole")
    assert (tmp_path / "core/track.csv").read_bytes() == (tmp_path / "whole/track.csv").read_bytes()


@pytest.mark.parametrize(("package", "words"), [
    ("starlette", ("live", "--board", "x", "--page")),
    ("websockets", ("replay", WALK, "--page")),
    ("uvicorn", ("command", "x.mcap", *PLAN, "--page")),
    ("starlette", ("plan", "edit", DEMO)),
    ("paho", ("live", "--board", "x", "--no-page", "--publish", "mqtt://h", "--name", "a")),
    ("paho", ("command", "mqtts://h", *PLAN, "--no-page")),
    ("pyproj", ("live", "--board", "x", "--no-page", "--publish", "cot+udp://h", "--name", "a")),
    ("pyproj", ("export", WALK, *PLAN, "-o", "x.kml")),
    ("pyarrow", ("export", WALK, *PLAN, "-o", "x.parquet")),
    ("foxglove", ("live", "--board", "x", "--foxglove", "8765")),
    ("scipy", ("map", WALK, "-o", "x.json")),
    ("matplotlib", ("map", WALK, "-o", "x.json", "--picture", "x.png")),
    ("matplotlib", ("plan", "show", DEMO, "-o", "x.png")),
    ("matplotlib", ("plan", "check", DEMO, "--picture", "x.png")),
    ("matplotlib", ("plan", "overlay", DEMO, "-o", "x.kmz")),
    ("matplotlib", ("foot", "x.csv", "--picture", "x.pdf")),
    ("matplotlib", ("legs", "x.csv", "--thigh", "0.4", "--shank", "0.4", "--picture", "x.pdf")),
])  # fmt: skip
def test_a_command_that_lacks_a_package_says_which_before_it_begins(
    package: str, words: tuple[object, ...], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    done = echostep(*words, cwd=tmp_path)
    said = f" needs {package}, which is not installed: pip install 'echostep[{EXTRAS[package]}]'\n"
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert done.stderr.startswith("echostep: ")
    assert done.stderr.endswith(said)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("name", "package"), [("x.dxf", "ezdxf"), ("x.ifc", "ifcopenshell")])
def test_an_importer_that_lacks_its_library_says_which(
    name: str, package: str, core: dict[str, str], tmp_path: Path
) -> None:
    (tmp_path / name).write_text("")
    done = run(core, tmp_path, "plan", "import", name, "-o", "plan.json")
    extra = EXTRAS[package]
    kind = name[2:].upper()
    assert done.stderr == (
        f"echostep: {name}: {kind} needs {package}, which is not installed: pip install 'echostep[{extra}]'\n"
    )


def test_an_import_that_nothing_has_looked_for_is_a_line_too(monkeypatch: pytest.MonkeyPatch) -> None:
    def lacking(name: str) -> str:
        monkeypatch.setattr(cli, "app", mock.Mock(side_effect=ModuleNotFoundError(name, name=name)))
        return echostep("demo").stderr

    monkeypatch.setitem(sys.modules, "matplotlib", None)
    line = "echostep: this needs matplotlib, which is not installed: pip install 'echostep[plots]'\n"
    assert lacking("matplotlib.figure") == line
    with pytest.raises(ModuleNotFoundError):
        lacking("shapely")
