# SPDX-License-Identifier: MIT
"""What has left is answered with one sentence that names what serves instead."""

from __future__ import annotations

import pytest

from command_line import echostep
from echostep.errors import INSTEAD, former_use, has_left

TYPED = [use for use in INSTEAD if not use.startswith("[")]


@pytest.mark.parametrize("use", TYPED)
def test_a_former_use_ends_with_the_sentence_that_names_its_substitute(use: str) -> None:
    *command, last = use.split()
    words = [*command, f"{last}x" if last.endswith((":", "/")) else last]
    done = echostep(*words, ends=2)
    assert done.stderr == f"echostep: {has_left(use)}\n"


def test_a_command_line_of_today_is_no_former_use(monkeypatch: pytest.MonkeyPatch) -> None:
    rows = {"former": "now", "live --old": "new", "plan make --size": "none", "far://": "near://", "--on who:": "file"}
    for use, instead in rows.items():
        monkeypatch.setitem(INSTEAD, use, instead)
    for today in (
        "live former",
        "live --name former",
        "replay --old",
        "plan make",
        "live --publish farther",
        "live --to who:x --on",
        "",
    ):
        assert not former_use(today.split())
    for before in (
        "former x",
        "--share former",
        "live --old=3",
        "plan make a --size 2",
        "live --publish=far://x",
        "live --on who:x",
    ):
        assert former_use(before.split())
