# SPDX-License-Identifier: MIT
"""Tests and tools take the filter, its aids, odometry, plans and recordings by their faces, as the other rings do [.importlinter].

What looks behind a face: the tests of the core with their twins, and of the repair of recordings, as the repair itself does.
"""

from __future__ import annotations

import re

from board_runs import ROOT

BEHIND = re.compile(r"\b(?:from|import) echostep\.(aiding|localization|odometry|plan|recording)\.\w+")
OWN = ("tests/core", "tests/naive")
OF_RECORDINGS = "tests/app/recording"


def test_nothing_else_looks_behind_a_face() -> None:
    found = []
    for path in sorted(
        [*(ROOT / "tests").rglob("*.py"), *(ROOT / "tools").rglob("*.py"), *(ROOT / "protocol").rglob("*.py")]
    ):
        name = path.relative_to(ROOT).as_posix()
        for package in [] if name.startswith(OWN) else BEHIND.findall(path.read_text()):
            if not (package == "recording" and name.startswith(OF_RECORDINGS)):
                found.append(f"{name}: {package}")
    assert not found
