# SPDX-License-Identifier: MIT
"""Each source file names its licence: GPL-3.0-or-later in tools/twin, which links simavr, MIT elsewhere; and the dependencies state theirs."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from board_runs import ROOT
from release import licences

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


def all_sources() -> list[Path]:
    parts = ("firmware", "host", "protocol", "tests", "tools")
    return [ROOT / "Makefile", ROOT / ".ci/run", *(path for part in parts for path in sources(ROOT / part))]


def test_each_source_file_names_its_licence() -> None:
    files = all_sources()
    assert len(files) > 400
    for path in files:
        licence = "GPL-3.0-or-later" if path.is_relative_to(ROOT / "tools/twin") else "MIT"
        first_lines = "\n".join(path.read_text().splitlines()[:2]) + "\n"
        assert f"SPDX-License-Identifier: {licence}" in first_lines, path


def test_the_licence_of_every_dependency_is_listed() -> None:
    """Those of pyproject.toml and of its extras, and what they need in turn."""
    listed = licences.needed("echostep-app", ("all",))
    assert {"numpy", "numba", "llvmlite", "starlette", "anyio"} <= set(listed)
    assert {"starlette", "scipy", "meshtastic"}.isdisjoint(licences.needed("echostep-app"))
    assert "pytest" not in listed
    for name, package in listed.items():
        assert licences.licence(package) != licences.UNKNOWN, name
        assert "GPL" not in licences.licence(package).replace("LGPL", ""), f"{name} would bind a program that is MIT"


@pytest.mark.slow
def test_make_licences_prints_a_row_for_each(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.argv", ["licences.py"])
    assert licences.main() == 0
    rows = capsys.readouterr().out.splitlines()[2:]
    assert len(rows) > len(licences.needed("echostep-app"))
    for name, use in (("numpy", "to run"), ("scipy", "by an extra"), ("distributed", "to develop, or by the studies")):
        row = next(row for row in rows if row.startswith(f"| {name} "))
        assert re.fullmatch(rf"\| {name} \| [\d.]+ \| .*BSD.* \| {use} \|", row)
