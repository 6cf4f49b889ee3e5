# SPDX-License-Identifier: MIT
"""Names on a drawn level, without overlap, in fonts that have their letters.

In: labels in order of importance, and the axes with their final place on the figure. Out: the texts that fit. Owns the places taken.
A name is made smaller, then left out, where it would cover one that is drawn already.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from echostep.arrays import Floats

SMALLER = (1.0, 0.8, 0.6)  # shares of the wanted size, tried in this order; assumed
SMALLEST_PT = 3.0  # of a name: legible when magnified
BASE_FONT = "DejaVu Sans"  # comes with matplotlib
APART_PX = 1.0  # between two names


@dataclass(frozen=True, slots=True)
class Label:
    """A text at a position in metres. `offsets_pt`: from there to the text's middle, the first that fits is taken."""

    position_m: tuple[float, float]
    text: str
    size_pt: float
    colour: str
    offsets_pt: tuple[tuple[float, float], ...] = ((0.0, 0.0),)


@contextmanager
def fonts_for(texts: Iterable[str]) -> Iterator[str]:
    """Draw inside with fonts that have the letters of these texts; gives the letters that no installed font has, which are drawn as boxes."""
    import matplotlib as mpl
    from matplotlib.font_manager import findfont, fontManager

    families = [BASE_FONT]
    missing = {letter for text in texts for letter in text if letter.isprintable() and not letter.isspace()}
    missing -= _letters(str(findfont(BASE_FONT)))
    fonts = [font for font in fontManager.ttflist if not font.name.startswith("Last Resort")]  # its letters are boxes
    for font in sorted(fonts, key=lambda font: (font.style != "normal", font.weight not in (400, "normal"), font.name)):
        if missing and (found := missing & _letters(font.fname)):
            families.append(font.name)
            missing -= found
    with mpl.rc_context({"font.family": families}), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing from")
        yield "".join(sorted(missing))


@cache
def _letters(path: str) -> frozenset[str]:
    """The letters that a font file has; none for a damaged one."""
    from matplotlib.ft2font import FT2Font

    try:
        return frozenset(map(chr, FT2Font(path).get_charmap()))
    except (OSError, RuntimeError):
        return frozenset()


def draw_labels(axes: Any, labels: Sequence[Label]) -> int:
    """Draw the labels that fit in view; returns how many in view do not."""
    taken: list[Floats] = []
    left_out = 0
    for label in labels:
        if _in_view(axes, label.position_m) and not _draw(axes, label, taken):
            left_out += 1
    return left_out


def _draw(axes: Any, label: Label, taken: list[Floats]) -> bool:
    """Draw one label at its first size and offset that covers none of the boxes `taken`; adds its own box."""
    from matplotlib.patheffects import withStroke

    drawn = axes.annotate(
        label.text, label.position_m, (0.0, 0.0), textcoords="offset points", size=label.size_pt, color=label.colour,
        parse_math=False, annotation_clip=True, clip_on=True, zorder=8, ha="center", va="center",
        path_effects=[withStroke(linewidth=2.0, foreground="white")],  # legible over lines
    )  # fmt: skip
    pixels_pt = axes.figure.dpi / 72.0
    anchor = axes.transData.transform(label.position_m)
    extent = drawn.get_window_extent(axes.figure.canvas.get_renderer())
    box = np.array([extent.x0, extent.y0, extent.x1, extent.y1]) - np.tile(anchor, 2)
    for share in SMALLER:
        for offset in label.offsets_pt:
            place = np.tile(anchor + pixels_pt * np.array(offset), 2) + share * box
            if share * label.size_pt < min(SMALLEST_PT, label.size_pt) or _covers(place, taken):
                continue
            drawn.set_size(share * label.size_pt)
            drawn.set_position(offset)
            taken.append(place)
            return True
    drawn.remove()
    return False


def _covers(box: Floats, taken: list[Floats]) -> bool:
    """Whether a box x0, y0, x1, y1 in pixels overlaps one of the others, or almost."""
    if not taken:
        return False
    x0, y0, x1, y1 = np.array(taken).T
    apart = (
        (box[2] + APART_PX <= x0) | (box[0] >= x1 + APART_PX) | (box[3] + APART_PX <= y0) | (box[1] >= y1 + APART_PX)
    )
    return not bool(apart.all())


def _in_view(axes: Any, position_m: tuple[float, float]) -> bool:
    (x0, x1), (y0, y1) = axes.get_xlim(), axes.get_ylim()
    return bool(x0 <= position_m[0] <= x1 and y0 <= position_m[1] <= y1)
