# SPDX-License-Identifier: MIT
"""The list of tested versions has all dependencies, in versions that the package allows, each with its hashes; setup installs nothing else."""

from __future__ import annotations

import subprocess
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from board_runs import ROOT

LISTED = dict(
    line.removesuffix(" \\").split("==")
    for line in (ROOT / "host/tested-versions.txt").read_text().splitlines()
    if not line.startswith(("#", "    --hash=sha256:"))
)


def test_every_dependency_has_a_tested_version_that_is_allowed() -> None:
    project = tomllib.loads((ROOT / "host/pyproject.toml").read_text())["project"]
    extras = (text for extra, texts in project["optional-dependencies"].items() if extra != "studies" for text in texts)
    requirements = [Requirement(text) for text in (*project["dependencies"], *extras)]
    requirements = [one for one in requirements if one.name != "echostep"]
    assert len(requirements) > 35
    for requirement in requirements:
        assert requirement.specifier.contains(LISTED[canonicalize_name(requirement.name)]), requirement


HASHED, NEWEST = "--require-hashes -r host/tested-versions.txt", "-e host[dev] -e host/studies[cluster]"


def test_every_version_has_hashes() -> None:
    packages = (ROOT / "host/tested-versions.txt").read_text().split("\n", 1)[1].replace(" \\\n", "").splitlines()
    assert len(packages) == len(LISTED) > 100
    assert all(" --hash=sha256:" in package for package in packages)


@pytest.mark.process
@pytest.mark.parametrize(
    ("said", "status", "installs"),
    [
        ("", 0, [HASHED, "--no-deps --no-build-isolation -e host -e host/studies"]),
        ("ERROR: THESE PACKAGES DO NOT MATCH THE HASHES", 1, [HASHED]),
        ("ERROR: No matching distribution found for x==1", 0, [HASHED, NEWEST]),
    ],
)  # fmt: skip
def test_setup_takes_no_file_with_another_hash(tmp_path: Path, said: str, status: int, installs: list[str]) -> None:
    """With a pip that only notes what it is asked for."""
    fails = f'case "$*" in *require-hashes*) echo "{said}" >&2; exit 1;; esac' if said else ""
    pip = tmp_path / "pip"
    pip.write_text(f'#!/bin/sh\necho "$@" >> {tmp_path}/asked\n{fails}\n')
    pip.chmod(0o755)
    done = subprocess.run([ROOT / "tools/setup.sh", tmp_path], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == status
    asked = (tmp_path / "asked").read_text().splitlines()
    assert asked == [f"install --quiet --disable-pip-version-check {words}" for words in installs]
    assert ("DO NOT MATCH" in done.stderr) == bool(status)
