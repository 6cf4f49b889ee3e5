# SPDX-License-Identifier: MIT
"""Pictures of a plan (a scan, a photograph, a page of a PDF made into a picture) -> `Plan`.

In: a picture, metres a pixel. Out: `Plan` of one level. Owns the least size of a wall. Areas darker than the threshold of Otsu [1979: the one
that separates the grey values best] become walls by their outlines; a picture shows no doors, so gaps are the ways through.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from shapely.affinity import scale

from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep.plan import Plan
from echostep_app.plan.importers.connector_shapes import plan_of
from echostep_app.plan.importers.drawn_level import DrawnLevel
from echostep_app.plan.importers.raster.tracing import grey, trace
from echostep_app.plan.importers.report import ImportReport

SMALL_M = 0.6  # groups of pixels that are nowhere longer are letters and symbols; assumed
PAPER, INK = 255, 0  # a transparent pixel is paper
TRACED = "traced from a picture: long words, furniture, stairs and swings of doors are walls too; echostep plan edit corrects it"


def import_picture(path: Path, pixel_m: float, report: ImportReport) -> Plan:
    """Import a picture's dark areas as walls; raises EchostepError that names the file."""
    values = grey(path, PAPER)
    if np.ptp(values) == 0.0:  # white ink on transparent paper
        values = grey(path, INK)
    dark = values <= threshold(values)
    if 0.5 < dark.mean() < 1.0:
        dark = ~dark
        report.doubt("most of it is dark, so what is bright was taken for walls")
    if dark.all():
        raise EchostepError(f"{path}: one colour all over: is this the plan?")
    outlines, noise = trace(dark, path)
    areas = [scale(area, pixel_m, pixel_m, origin=(0, 0)) for area in outlines]
    large = [area for area in areas if max(area.bounds[2] - area.bounds[0], area.bounds[3] - area.bounds[1]) > SMALL_M]
    if not large:
        raise EchostepError(f"{path}: nothing dark in it is longer than {SMALL_M:g} m: is the scale right?")
    if small := noise + len(areas) - len(large):
        report.leave_out(f"spots and letters up to {SMALL_M:g} m", small)
    report.units = f"{pixel_m:.4g} m a pixel (--scale)"
    report.doubt(TRACED)
    plan = plan_of(path.stem, [DrawnLevel(path.stem, 0.0, walls=[*large])], report)
    return replace(plan, picture=(pixel_m, 0.0, 0.0))


def threshold(values: Floats) -> float:
    """The grey value (0 to 255) up to which pixels are dark: the greatest variance between the dark and the bright ones [Otsu 1979]."""
    counts = np.bincount(values.astype(np.uint8).ravel(), minlength=256).astype(np.float64)
    dark, levels = np.cumsum(counts), np.arange(256)
    below = np.cumsum(counts * levels)
    bright = dark[-1] - dark
    with np.errstate(divide="ignore", invalid="ignore"):
        between = dark * bright * (below / dark - (below[-1] - below) / bright) ** 2
    return float(np.nan_to_num(between).argmax())
