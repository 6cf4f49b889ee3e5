# SPDX-License-Identifier: MIT
"""An update in place: kernels compiled from older sources are never used, and never fail to load."""

from __future__ import annotations

import os
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

import echostep
from echostep import kernel_cache
from echostep.errors import EchostepError
from echostep.jit import DAMAGED, CheckedFiles
from echostep.kernel_cache import PACKAGE, cache_folder
from waiting import PATIENCE_S, ran

ANOTHER_USER = 1234  # a number that no account of a computer need have
AS_ANOTHER_USER = (
    *("setpriv", f"--reuid={ANOTHER_USER}", f"--regid={ANOTHER_USER}", "--clear-groups"),
    *("--inh-caps=+dac_read_search", "--ambient-caps=+dac_read_search"),
)
needs_another_user = pytest.mark.skipif(
    os.geteuid() != 0 or shutil.which("setpriv") is None,
    reason="only root can be another user for the length of a test",
)


SHAPES = """
from typing import NamedTuple
from echostep.jit import kernel
UNIT = {unit}
class {name}(NamedTuple):
    width: float
@kernel
def area(shape):
    return UNIT * shape.width * shape.width
"""
MAIN = """
from echostep import shapes
from echostep.jit import kernel
@kernel
def twice(shape):
    return 2.0 * shapes.area(shape)
print(twice(shapes.{name}(3.0)))
"""

PROBE = """
from numpy import zeros
from echostep_app.plan.polyline import along
assert along(zeros((2, 2)), 0.0) == (0.0, 0.0, 0.0)
print(along._cache.cache_path)
"""


def run(package: Path, name: str, unit: float) -> str:
    """What the small package prints with this class and constant in one of its files."""
    (package / "shapes.py").write_text(SHAPES.format(name=name, unit=unit))
    command = [sys.executable, "-c", "import echostep.main"]
    environment = {**os.environ, "PYTHONPATH": str(package.parent), "NUMBA_CACHE_DIR": ""}
    done = ran(command, timeout=5.0 * PATIENCE_S, env=environment)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.long
@pytest.mark.process
def test_an_update_in_place_is_compiled_anew_and_the_old_kernels_go(tmp_path: Path) -> None:
    package = tmp_path / "echostep"
    package.mkdir()
    for name in ("errors", "jit", "kernel_cache"):
        shutil.copy(f"{PACKAGE}/{name}.py", package)
    (package / "__init__.py").touch()
    (package / "main.py").write_text(MAIN.format(name="Square"))
    assert run(package, "Square", 1.0) == "18.0\n"
    assert run(package, "Square", 2.0) == "36.0\n"  # a constant of another file
    (kept,) = package.glob("__pycache__/main-*/*/*.nbi")
    (package / "main.py").write_text(MAIN.format(name="Quadrat"))
    assert run(package, "Quadrat", 2.0) == "36.0\n"  # a class of another file, by another name
    (new,) = package.glob("__pycache__/main-*/*/*.nbi")
    assert new != kept


def test_folders_stand_beside_the_sources_or_where_numba_is_told_to_put_them() -> None:
    source = f"{PACKAGE}/walls/index.py"
    folder = cache_folder(source)
    assert folder is not None
    assert folder.name.startswith("index-")
    assert cache_folder(__file__) is None
    assert cache_folder(f"{PACKAGE}/nowhere.py") is None
    assert echostep.__file__.startswith(PACKAGE)


def folder_of(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, home: Path | None) -> Path:
    """Where kernels go when the package cannot be written, with this home, and a temporary folder of the test's."""
    for name in ("_users_folder", "_temporary_folder"):
        getattr(kernel_cache, name).cache_clear()
    package = tmp_path / "p"
    package.mkdir(exist_ok=True)
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setattr(tempfile, "gettempdir", lambda: str(tmp_path))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    access = os.access
    monkeypatch.setattr(os, "access", lambda path, mode: Path(path) != package and access(path, mode))

    def at_home(_: type[Path]) -> Path:
        if home is None:
            raise RuntimeError("Could not determine home directory.")
        return home

    monkeypatch.setattr(Path, "home", classmethod(at_home))
    return kernel_cache._folder(package, package, "k")


def test_without_a_home_kernels_go_to_a_temporary_folder_that_is_told_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert folder_of(tmp_path, monkeypatch, tmp_path / "home") == tmp_path / "home/.cache/p/k"
    for home in (None, Path("/proc/nowhere")):
        assert folder_of(tmp_path, monkeypatch, home) == tmp_path / f"echostep-kernels-{os.getuid()}/p/k"
    assert capsys.readouterr().err.count("no cache folder that can be written") == 1


def test_a_temporary_folder_that_another_user_may_write_is_not_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / f"echostep-kernels-{os.getuid()}").mkdir()
    (tmp_path / f"echostep-kernels-{os.getuid()}").chmod(0o777)
    used = folder_of(tmp_path, monkeypatch, None)
    assert used.parents[1].name not in ("", f"echostep-kernels-{os.getuid()}")
    assert "give a folder in NUMBA_CACHE_DIR" in capsys.readouterr().err


@pytest.fixture
def open_path() -> Iterator[Path]:
    """A folder that every user can search, unlike pytest's."""
    with tempfile.TemporaryDirectory() as folder:
        Path(folder).chmod(0o755)
        yield Path(folder)


@needs_another_user
@pytest.mark.process
@pytest.mark.parametrize("given", ["", "/chosen", "/home"])
def test_a_user_who_cannot_write_the_folder_for_kernels_has_them_elsewhere(open_path: Path, given: str) -> None:
    """Neither the installation, nor NUMBA_CACHE_DIR, nor a cache at home that `sudo` has made: in a folder of the user's, and that is said once."""
    (open_path / "temporary").mkdir()
    (open_path / "temporary").chmod(0o1777)
    (open_path / "chosen").mkdir()
    (open_path / "home/.cache/echostep_app").mkdir(parents=True)
    os.chown(open_path / "home/.cache", ANOTHER_USER, ANOTHER_USER)
    environment = {
        "HOME": f"{open_path}/home" if given == "/home" else "/nonexistent",
        "TMPDIR": f"{open_path}/temporary",
    }
    environment |= {"NUMBA_CACHE_DIR": f"{open_path}/chosen"} if given == "/chosen" else {}
    for run_number in range(1 if given else 2):
        env = {"PATH": os.environ["PATH"], "PYTHONPATH": os.pathsep.join(sys.path), **environment}
        done = ran([*AS_ANOTHER_USER, sys.executable, "-c", PROBE], timeout=5.0 * PATIENCE_S, cwd="/", env=env)
        assert done.returncode == 0, done.stderr
        kept = open_path / f"temporary/echostep-kernels-{ANOTHER_USER}"
        assert done.stdout.startswith(str(kept / "echostep_app/plan"))
        assert done.stderr.count("kernels are kept in") == (not run_number) + (given == "/chosen")
        assert done.stderr.count(f"NUMBA_CACHE_DIR: {open_path}/chosen cannot be written") == (given == "/chosen")


def test_where_nothing_can_be_written_the_error_names_what_to_give(monkeypatch: pytest.MonkeyPatch) -> None:
    def nowhere() -> str:
        raise FileNotFoundError(2, "No usable temporary directory found in ['/tmp']")

    monkeypatch.setattr(tempfile, "gettempdir", nowhere)
    kernel_cache._temporary_folder.cache_clear()
    with pytest.raises(EchostepError, match="give one in NUMBA_CACHE_DIR"):
        kernel_cache._temporary_folder()


KEPT = """
from echostep.jit import kernel
@kernel
def twice(x):
    return 2.0 * x
print(twice(21.0), twice(2), len(twice.stats.cache_hits), len(twice.stats.cache_misses))
"""
DAMAGES: dict[str, Callable[[bytes], bytes]] = {
    "nothing": lambda content: content[:0],
    "half": lambda content: content[: len(content) // 2],
    "zeros": lambda content: bytes(len(content)),
    "its end": lambda content: content[:-1],
    "zeros inside": lambda content: content[:100] + bytes(64) + content[164:],
}


def start(folder: Path) -> tuple[list[str], str]:
    """What the module of this folder prints, and its errors."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), "NUMBA_CACHE_DIR": f"{folder}/cache"}
    done = ran([sys.executable, "-m", "kept"], timeout=5.0 * PATIENCE_S, cwd=folder, env=environment)
    assert done.returncode == 0, done.stderr
    return done.stdout.split(), done.stderr


@pytest.fixture(scope="module")
def compiled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a module, and its kernels in `whole`."""
    folder = tmp_path_factory.mktemp("compiled")
    (folder / "kept.py").write_text(KEPT)
    assert start(folder) == (["42.0", "4.0", "0", "2"], "")
    assert start(folder) == (["42.0", "4.0", "2", "0"], "")
    shutil.copytree(folder / "cache", folder / "whole")
    return folder


def hurt(files: list[Path], damage: str) -> None:
    assert files
    for file in files:
        content = file.read_bytes()
        file.unlink()
        if damage == "a folder":
            file.mkdir()
        elif damage != "gone":
            file.write_bytes(DAMAGES[damage](content))


@pytest.mark.parametrize("kind", ["nbi", "nbc"])
@pytest.mark.parametrize("damage", [*DAMAGES, "a folder", "gone"])
def test_a_damaged_file_is_put_aside_and_written_anew(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], kind: str, damage: str
) -> None:
    kernel_cache.tell.cache_clear()
    files, content = CheckedFiles(str(tmp_path), "k", "stamp"), list(range(1000))
    files.save("key", content)
    assert files.load("key") == content
    hurt([*tmp_path.glob(f"*.{kind}")], damage)
    assert files.load("key") is None
    files.save("key", content)
    assert files.load("key") == content
    assert len([*tmp_path.glob("*.damaged")]) == (damage != "gone")
    assert capsys.readouterr().err == ("" if damage == "gone" else f"echostep: {DAMAGED}\n")


@pytest.mark.process
def test_kernels_of_a_damaged_file_are_made_anew(compiled: Path) -> None:
    shutil.rmtree(compiled / "cache")
    shutil.copytree(compiled / "whole", compiled / "cache")
    hurt(sorted(compiled.glob("cache/*/*.nbc")), "its end")
    assert start(compiled) == (["42.0", "4.0", "0", "2"], f"echostep: {DAMAGED}\n")
    assert start(compiled) == (["42.0", "4.0", "2", "0"], "")


def test_an_index_of_another_numba_is_no_damage(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = CheckedFiles(str(tmp_path), "k", "stamp")
    file._version = "0.1"
    file.save("key", 1)
    assert CheckedFiles(str(tmp_path), "k", "stamp").load("key") is None
    assert file.load("key") == 1
    assert capsys.readouterr().err == ""
