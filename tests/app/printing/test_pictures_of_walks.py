# SPDX-License-Identifier: MIT
"""Pictures of walks, plans and feet: files of each kind, and what a notebook shows."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import echostep
from echostep.errors import EchostepError
from echostep.plan import load_plan
from echostep_app.printing.picture_files import ENDINGS
from walks import DEMO, WALK, foot_track


@pytest.fixture(scope="module")
def walk() -> echostep.Walk:
    """The recorded walk on its plan."""
    return echostep.replay(WALK, DEMO)


@pytest.mark.parametrize("ending", ENDINGS)
def test_a_picture_is_of_the_kind_of_its_name_and_the_same_each_time(
    ending: str, walk: echostep.Walk, tmp_path: Path
) -> None:
    begins = {".png": b"\x89PNG", ".svg": b"<?xml", ".pdf": b"%PDF"}
    walk.draw(first := tmp_path / f"first{ending}")
    walk.draw(str(again := tmp_path / f"again{ending}"))
    assert first.read_bytes().startswith(begins[ending])
    assert first.read_bytes() == again.read_bytes()


def test_another_kind_of_picture_is_refused(walk: echostep.Walk, tmp_path: Path) -> None:
    with pytest.raises(EchostepError, match=r"track\.gif: cannot draw .* ends in \.png, \.svg or \.pdf"):
        walk.draw(tmp_path / "track.gif")
    assert not list(tmp_path.iterdir())


SHOWN: dict[str, Callable[[], Any]] = {
    "walk": lambda: echostep.replay(WALK, DEMO),
    "plan": lambda: load_plan(DEMO),
    "foot": foot_track,
}


@pytest.mark.parametrize("name", SHOWN)
def test_a_notebook_shows_a_picture_and_without_matplotlib_a_line(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    shown = SHOWN[name]()
    assert "</svg>" in (shown._repr_svg_() or "")
    assert "\n" not in repr(shown)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert shown._repr_svg_() is None
