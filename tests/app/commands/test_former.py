# SPDX-License-Identifier: MIT
"""A setting that has left ends with one sentence that names what serves instead; a recording replays without it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from echostep.errors import INSTEAD, EchostepError, has_left
from echostep.plan import load_plan
from echostep.recording import open_parts
from echostep.settings import Settings, parse_settings
from echostep.walk.recorded import tracker_of
from echostep_app.recording.recorder import Recorder
from walks import DEMO, walk_chunks


@pytest.mark.parametrize("use", INSTEAD)
def test_a_former_setting_is_refused_in_a_file_and_passed_over_in_a_recording(use: str, tmp_path: Path) -> None:
    section, name = use.split()
    text = f"{section}\n{name} = 1\n\n[gait]\nfoot_left_m = 0.05\n"
    with pytest.raises(EchostepError, match=re.escape(f"me.toml: {has_left(use)}")):
        parse_settings(text, "me.toml")
    with Recorder(tmp_path / "walk.mcap", {"settings_toml": text}) as recorder:
        for chunk in walk_chunks(1.0):
            recorder.write(chunk)
    settings = tracker_of(open_parts([tmp_path / "walk.mcap"]), load_plan(DEMO)).settings
    assert settings.gait.foot_left_m == 0.05
    assert (settings.ranger, settings.cloud) == (Settings().ranger, Settings().cloud)
