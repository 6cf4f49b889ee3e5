# SPDX-License-Identifier: MIT
"""The list of tested versions has all dependencies, in versions that the package allows."""

from __future__ import annotations

import tomllib

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from board_runs import ROOT

LISTED = dict(
    line.split("==")
    for line in (ROOT / "host/tested-versions.txt").read_text().splitlines()
    if not line.startswith("#")
)


def test_every_dependency_has_a_tested_version_that_is_allowed() -> None:
    project = tomllib.loads((ROOT / "host/pyproject.toml").read_text())["project"]
    extras = (text for extra, texts in project["optional-dependencies"].items() if extra != "studies" for text in texts)
    requirements = [Requirement(text) for text in (*project["dependencies"], *extras)]
    requirements = [one for one in requirements if one.name != "echostep"]
    assert len(requirements) > 35
    for requirement in requirements:
        assert requirement.specifier.contains(LISTED[canonicalize_name(requirement.name)]), requirement
