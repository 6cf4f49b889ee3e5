# SPDX-License-Identifier: MIT
"""A use of what has left ends with one sentence that names what serves instead; a recording replays without it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from command_line import echostep
from echostep.errors import INSTEAD, EchostepError, has_left
from echostep.recording import open_parts
from echostep.settings import Settings, parse_settings
from echostep.walk.recorded import tracker_of
from echostep_app.cli import former_use
from recording.damages import write_recording
from walks import PLAN, walk_chunks

SETTINGS = [use for use in INSTEAD if use.startswith("[")]
TYPED = [use for use in INSTEAD if not use.startswith("[")]


@pytest.mark.parametrize("use", TYPED)
def test_a_former_use_ends_with_the_sentence_that_names_its_substitute(use: str) -> None:
    *command, last = use.split()
    words = [*command, f"{last}x" if last.endswith((":", "/")) else last]
    done = echostep(*words, ends=2)
    assert done.stderr == f"echostep: {has_left(use)}\n"


@pytest.mark.parametrize("use", SETTINGS)
def test_a_former_setting_is_refused_in_a_file_and_passed_over_in_a_recording(use: str, tmp_path: Path) -> None:
    section, name = use.split()
    text = f"{section}\n{name} = 1\n\n[gait]\nfoot_left_m = 0.05\n"
    with pytest.raises(EchostepError, match=re.escape(f"me.toml: {has_left(use)}")):
        parse_settings(text, "me.toml")
    write_recording(tmp_path / "walk.mcap", walk_chunks(1.0), {"settings_toml": text})
    settings = tracker_of(open_parts([tmp_path / "walk.mcap"]), PLAN).settings
    assert settings.gait.foot_left_m == 0.05
    assert (settings.ranger, settings.cloud) == (Settings().ranger, Settings().cloud)


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
