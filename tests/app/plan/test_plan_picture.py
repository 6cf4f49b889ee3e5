# SPDX-License-Identifier: MIT
"""Pictures of plans: axes around what is there, fonts that have the letters of the names, letters that no font has."""

from __future__ import annotations

import json
from pathlib import Path

import matplotlib.font_manager as fonts
import pytest

import command_line
from echostep.plan import Plan, load_plan
from echostep_app.plan.pictures import drawing, labels
from echostep_app.plan.pictures.drawing import draw_plan

WALLS = [[400, 300, 404, 300], [404, 300, 404, 303], [404, 303, 402, 303], [401, 303, 400, 303], [400, 303, 400, 300]]


def plan_of(folder: Path, name: str = "Office") -> Plan:
    ground = {"name": "Ground", "height_m": 0, "walls": WALLS, "rooms": [{"name": name, "at": [402, 301.5]}]}
    tree = {"echostep_plan": 1, "levels": [ground, {"name": "Roof", "height_m": 3, "walls": []}]}
    (folder / "plan.json").write_text(json.dumps(tree))
    return load_plan(folder / "plan.json")


def test_axes_are_around_the_walls(tmp_path: Path) -> None:
    """An empty level does not draw the origin into the picture."""
    plan = plan_of(tmp_path)
    x0, y0, x1, y1 = drawing._about(list(plan.levels))
    assert (399 < x0 < 400, 299 < y0 < 300, 404 < x1 < 405, 303 < y1 < 304) == (True,) * 4
    assert drawing._about([plan.levels[1]]) == pytest.approx((-0.3, -0.3, 10.3, 10.3))


@pytest.mark.process
def test_letters_that_no_font_has_are_named_in_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With the one font that matplotlib brings."""
    monkeypatch.setattr(fonts.fontManager, "ttflist", [f for f in fonts.fontManager.ttflist if f.name == "DejaVu Sans"])
    plan_of(tmp_path, "機械室 A")
    done = command_line.echostep("plan", "show", tmp_path / "plan.json", "-o", tmp_path / "x.png")
    assert done.returncode == 0
    assert (
        done.stdout
        == f"picture: {tmp_path / 'x.png'}; no font here has the letters 室械機: install one that does (fonts-noto-cjk, fonts-noto)\n"
    )
    assert not done.stderr
    plan_of(tmp_path, "Büro, Šatna, Кухня, Αίθουσα")
    assert (
        command_line.echostep("plan", "show", tmp_path / "plan.json", "-o", tmp_path / "x.png").stdout
        == f"picture: {tmp_path / 'x.png'}\n"
    )


def test_a_font_that_has_the_letters_is_used(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """DejaVu Sans without its capital A stands for a font that lacks a script; another installed font has it."""
    real = labels._letters
    monkeypatch.setattr(
        labels, "_letters", lambda path: real(path) - {"A"} if Path(path).name == "DejaVuSans.ttf" else real(path)
    )
    with labels.fonts_for(["A room"]) as missing:
        import matplotlib as mpl

        families = list(mpl.rcParams["font.family"])
    assert missing == ""
    assert len(families) == 2
    assert families[0] == labels.BASE_FONT
    assert draw_plan(plan_of(tmp_path, "A room"), tmp_path / "x.png", [0]) == ""
