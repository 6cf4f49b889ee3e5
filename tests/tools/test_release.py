# SPDX-License-Identifier: MIT
"""Each source file names its licence, the dependencies state theirs; tested versions are whole, allowed and hashed; set-up installs nothing else."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

import install
from board_runs import ROOT
from release import licences
from release.tested_versions import entries

SOURCES = {".py", ".c", ".h", ".js", ".css", ".html", ".svg", ".sh", ".toml", ".rules"}
BUILT = {"__pycache__", "build", "dist", "node_modules"}


def sources(folder: Path) -> Iterator[Path]:
    """Source files below a folder; what was built and what starts with a dot is none."""
    for path in sorted(folder.iterdir()):
        if path.name in BUILT or path.name.startswith("."):
            continue
        if path.is_dir():
            yield from sources(path)
        elif path.suffix in SOURCES or path.name == "Makefile":
            yield path


def test_each_source_file_names_its_licence() -> None:
    parts = ("firmware", "host", "protocol", "tests", "tools")
    files = [ROOT / "Makefile", ROOT / ".ci/run", *(path for part in parts for path in sources(ROOT / part))]
    assert len(files) > 400
    for path in files:
        licence = "GPL-3.0-or-later" if path.is_relative_to(ROOT / "tools/twin") else "MIT"
        first_lines = "\n".join(path.read_text().splitlines()[:2]) + "\n"
        assert f"SPDX-License-Identifier: {licence}" in first_lines, path


def test_the_licence_of_every_dependency_is_listed() -> None:
    """Those of pyproject.toml and of its extras, and what they need in turn."""
    listed = licences.needed("echostep-app", ("all",))
    assert {"numpy", "numba", "llvmlite", "starlette", "anyio"} <= set(listed)
    assert {"starlette", "scipy"}.isdisjoint(licences.needed("echostep-app"))
    assert "pytest" not in listed
    for name, package in listed.items():
        assert licences.licence(package) != licences.UNKNOWN, name
        assert "GPL" not in licences.licence(package).replace("LGPL", ""), f"{name} would bind a program that is MIT"


PROJECTS = [tomllib.loads((ROOT / f"host/{ring}/pyproject.toml").read_text())["project"] for ring in ("core", "app")]
EXTRAS = PROJECTS[1]["optional-dependencies"]


def wanted(*extras: str) -> list[Requirement]:
    """What the package with these extras requires of others."""
    texts = [text for project in PROJECTS for text in project["dependencies"]] + [
        *(text for extra in extras for text in EXTRAS[extra])
    ]
    return [one for one in map(Requirement, texts) if not one.name.startswith("echostep")]


def versions_of(part: str) -> dict[str, str]:
    """Version by name of what a part installs here."""
    requirements = [Requirement(entry.partition(" \\")[0]) for entry in entries(install.requirements(part))]
    here = [one for one in requirements if one.marker is None or one.marker.evaluate()]
    assert len({one.name for one in here}) == len(here)
    return {one.name: str(one.specifier).removeprefix("==") for one in here}


def test_every_dependency_has_a_tested_version_that_is_allowed() -> None:
    for part, extras in (("demo", ("page", "plots")), ("tests", tuple(EXTRAS))):
        versions = versions_of(part)
        for requirement in wanted(*extras):
            assert requirement.specifier.contains(versions[canonicalize_name(requirement.name)]), requirement


@pytest.mark.process
def test_bytecode_is_made_at_once_where_imports_may_not_keep_it() -> None:
    code = f"import sys; sys.path.insert(0, {str(Path(install.__file__).parent)!r}); import install; print(install.PIP[-1])"
    words = [subprocess.check_output([sys.executable, flag, "-c", code], text=True).strip() for flag in ("-B", "-I")]
    assert words == ["--compile", "--no-compile"]


HASHED, OWN = "--require-hashes -r", "--no-deps --no-build-isolation -e host/core -e host/app -e host/studies"
NEWEST = "-e host/core -e host/app[dev] -e host/studies[cluster]"


@pytest.mark.process
@pytest.mark.parametrize(
    ("said", "status", "installs"),
    [
        ("", 0, [HASHED, OWN]),
        ("ERROR: THESE PACKAGES DO NOT MATCH THE HASHES", 1, [HASHED]),
        ("ERROR: No matching distribution found for x==1", 0, [HASHED, NEWEST]),
    ],
)  # fmt: skip
def test_set_up_takes_no_file_with_another_hash(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], said: str, status: int,
    installs: list[str],
) -> None:  # fmt: skip
    """With a pip that only notes what it is asked for."""
    fails = f'case "$*" in *require-hashes*) echo "{said}" >&2; exit 1;; esac' if said else ""
    pip = tmp_path / "pip"
    pip.write_text(f'#!/bin/sh\necho "$@" >> {tmp_path}/asked\n{fails}\n')
    pip.chmod(0o755)
    monkeypatch.setattr(install, "PIP", [str(pip)])
    assert install.set_up("tests") == status
    asked = (tmp_path / "asked").read_text().splitlines()
    assert [re.sub(r"(-r) .*", r"\1", words) for words in asked] == installs
    assert ("DO NOT MATCH" in capsys.readouterr().err) == bool(status)
