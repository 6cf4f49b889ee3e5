# SPDX-License-Identifier: MIT
"""The plan editor on the demo's plan, and on a new plan over a picture."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from echostep_app.page.editor import EditServer
from walks import DEMO

PICTURE = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="400" height="300">'
    '<rect x="50" y="50" width="300" height="200" fill="none" stroke="#888" stroke-width="8"/></svg>'
)


@pytest.fixture
def served(tmp_path: Path) -> Iterator[EditServer]:
    shutil.copy(DEMO, tmp_path / "plan.json")
    with EditServer(tmp_path / "plan.json", port=0) as server:
        yield server


@pytest.fixture
def drawn(tmp_path: Path) -> Iterator[EditServer]:
    (tmp_path / "picture.svg").write_text(PICTURE)
    with EditServer(tmp_path / "new.json", tmp_path / "picture.svg", 0) as server:
        yield server
