# SPDX-License-Identifier: MIT
"""The list of tested versions has all dependencies, in versions that the package allows, each with its hashes; set-up installs nothing else."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

import install
from board_runs import ROOT
from release.tested_versions import entries

TEXT = (ROOT / "host/tested-versions.txt").read_text()
LISTED = [Requirement(entry.partition(" \\")[0]) for entry in entries(TEXT)]
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


def test_a_python_that_is_too_new_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    assert not install.newer_python()
    monkeypatch.setattr(sys, "version_info", (3, 99, 0))
    assert install.newer_python().startswith("Python 3.99 is newer than 3.")


@pytest.mark.process
@pytest.mark.parametrize(
    ("user", "apt", "words"),
    [
        ("0", "", "Installing: x"),
        ("1000", "", "this user has no right to"),
        (
            "0",
            "echo 'E: Release file for http://x/InRelease is expired' >&2; exit 100",
            "apt's package list has expired",
        ),
        ("0", "echo 'E: Unable to locate package x' >&2; exit 100", "apt says: Unable to locate package x"),
    ],
)
def test_apts_own_reason_is_told(tmp_path: Path, user: str, apt: str, words: str) -> None:
    """With an apt that fails so."""
    done = _installed(tmp_path, apt, user, "x")
    assert words in done.stdout
    assert done.returncode == int("Installing" not in words)


def _installed(folder: Path, apt: str, user: str, *packages: str) -> subprocess.CompletedProcess[str]:
    """`tools/apt.sh` with this apt, none of the packages there."""
    stubs = {"dpkg-query": "exit 1", "apt-get": apt, "id": f"echo {user}", "sudo": "exit 1"}
    for name, body in stubs.items():
        (folder / name).write_text(f"#!/bin/sh\n{body}\n")
        (folder / name).chmod(0o755)
    command, env = [str(ROOT / "tools/apt.sh"), *packages], {"PATH": f"{folder}:/usr/bin:/bin"}
    return subprocess.run(command, env=env, capture_output=True, text=True, check=False)
