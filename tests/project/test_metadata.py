# SPDX-License-Identifier: MIT
"""What a reader finds about the package elsewhere: the wheel's metadata as PyPI shows it, CITATION.cff."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
import zipfile
from email import message_from_string
from email.message import Message
from pathlib import Path
from urllib.parse import urlparse

import pytest
import yaml

from board_runs import ROOT
from release import wheel as wheels

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
    done = subprocess.run(
        [sys.executable, "-m", "twine", "check", "--strict", built], capture_output=True, text=True, check=False
    )
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
