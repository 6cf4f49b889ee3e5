# SPDX-License-Identifier: MIT
"""Pictures of walks, plans and feet: files of each kind, and what a notebook shows."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.collections import PatchCollection
from matplotlib.colors import to_hex

import echostep
from echostep.errors import EchostepError
from echostep.localization import LikelyPlace, TrackStatus
from echostep_app.output.track_plot import WORDS, track_figure
from echostep_app.printing.picture_files import ENDINGS
from walks import DEMO, PLAN, WALK, foot_track


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


def test_a_walk_is_drawn_in_outlines_on_its_plan(walk: echostep.Walk) -> None:
    """Each region in the colour of its word, and never larger than the plan; without one, each place as strong as its share."""
    end = walk.estimates[-1]
    places = tuple(LikelyPlace(share, 4.0, 5.0, 0, 0.5, 0.0) for share in (0.5, 0.3))
    doubtful = replace(end, t_s=end.t_s + 1.0, right=0.8, hypotheses=places, status=TrackStatus.UNCERTAIN, xx_m2=900.0)
    with track_figure(walk.plan, [*walk.estimates[:8], doubtful], None, "x") as figure:
        (axes,) = figure.axes
    (drawn,) = (each for each in axes.collections if isinstance(each, PatchCollection))
    assert not np.array(drawn.get_facecolor())[:, 3].any()
    edges = np.array(drawn.get_edgecolor())
    assert edges[-2:, 3].tolist() == [0.5, 0.3]
    assert {to_hex(tuple(edge)) for edge in edges.tolist()} == {
        WORDS[TrackStatus(w)] for w in ("tracking", "uncertain")
    }
    begins, ends = (next(each for each in axes.lines if each.get_marker() == sign) for sign in "os")
    assert (begins.get_fillstyle(), ends.get_fillstyle()) == (
        "full",
        "none",
    )  # both are seen where a walk ends as it began
    assert all(text.get_path_effects() for text in axes.texts)  # legible over the walk
    assert np.ptp(axes.get_xlim()) < 1.1 * np.ptp(walk.plan.levels[0].walls[:, ::2])


def test_another_kind_of_picture_is_refused(walk: echostep.Walk, tmp_path: Path) -> None:
    with pytest.raises(EchostepError, match=r"track\.gif: cannot draw .* ends in \.png, \.svg or \.pdf"):
        walk.draw(tmp_path / "track.gif")
    assert not list(tmp_path.iterdir())


SHOWN: dict[str, Callable[[], Any]] = {
    "walk": lambda: echostep.replay(WALK, DEMO),
    "plan": lambda: PLAN,
    "foot": foot_track,
}


@pytest.mark.parametrize("name", SHOWN)
def test_a_notebook_shows_a_picture_and_without_matplotlib_a_line(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    shown = SHOWN[name]()
    assert "</svg>" in (shown._repr_svg_() or "")
    assert "\n" not in repr(shown)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert shown._repr_svg_() is None
