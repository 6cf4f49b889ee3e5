# SPDX-License-Identifier: MIT
"""Pictures as files: PNG, SVG or PDF, by the ending of the name.

In: a figure of matplotlib, a path. Out: a file, with the same bytes for the same figure. Owns the endings.
"""

from __future__ import annotations

import io
from pathlib import Path
from typing import TYPE_CHECKING

from echostep.errors import EchostepError
from echostep.file_mode import claim, keep_earlier
from echostep_app.printing.lines import as_error

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ENDINGS = (".png", ".svg", ".pdf")
SALT = "echostep"  # of the names of an SVG's elements, which are random without it
WITHOUT_DATE = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}}  # equal pictures are equal files


def load_matplotlib() -> None:
    """Import matplotlib for a command: without the tables of properties in its documentation, which take a third of the time."""
    from matplotlib import artist as artists

    documented, artists.kwdoc = artists.kwdoc, lambda artist: ""  # noqa: ARG005
    import matplotlib.figure  # noqa: F401

    artists.kwdoc = documented


def check_picture(path: Path) -> Path:
    """The same path; raises EchostepError when no picture can be drawn into a file of this name."""
    if path.suffix.casefold() not in ENDINGS:
        *some, last = ENDINGS
        endings = f"{', '.join(some)} or {last}"
        raise EchostepError(f"{path}: cannot draw this kind of picture: give a name that ends in {endings}")
    return path


def save_picture(figure: Figure, path: Path, *, software: str = "echostep", private: bool = True) -> None:
    """Write a figure; `private`: as a file of a run is. Raises EchostepError when it cannot be written."""
    import matplotlib as mpl
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    ending = check_picture(path).suffix.casefold()
    metadata = WITHOUT_DATE.get(ending, {"Software": software})
    with as_error(f"{path}: cannot write the picture"), mpl.rc_context({"svg.hashsalt": SALT}):
        file = (claim if private else keep_earlier)(path)
        if ending == ".png":  # draws once; savefig draws twice
            FigureCanvasAgg(figure).print_png(file, metadata=metadata)  # type: ignore[no-untyped-call]
        else:
            figure.savefig(file, format=ending[1:], metadata=metadata)


def svg_text(figure: Figure) -> str:
    """A figure as SVG."""
    import matplotlib as mpl

    text = io.StringIO()
    with mpl.rc_context({"svg.hashsalt": SALT}):
        figure.savefig(text, format="svg", metadata=WITHOUT_DATE[".svg"])
    return text.getvalue()
