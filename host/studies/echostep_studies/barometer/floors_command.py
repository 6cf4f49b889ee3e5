# SPDX-License-Identifier: MIT
"""`echostep floors`: the floors of a recorded barometer as CSV, in words and as a picture.

In: a CSV file of pressures, the heights of the floors or `auto`. Out: a CSV file, a picture, a summary on the console. Owns nothing.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from rich.console import Console

from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep_app.offline.foreign_columns import OWN, Naming
from echostep_app.printing.picture_files import save_picture
from echostep_studies.barometer.altitude import Pressures
from echostep_studies.barometer.floor_filter import Floors, checked_heights, smooth_floors
from echostep_studies.barometer.floor_record import describe, find_storeys, noise_of_record, thinned
from echostep_studies.barometer.pressure_csv import load_pressures, write_floors

console = Console(soft_wrap=True, highlight=False)
MOST_POINTS = 5000  # about, of a curve in the picture


def floors(path: Path, heights: str, out: Path, start: int | None, picture: Path | None, naming: Naming = OWN) -> None:
    """Write the floors of a record and print the stays; raises EchostepError for options or samples that cannot be used."""
    given_m = None if heights.strip().lower() == "auto" else parse_heights(heights)
    if start is not None and given_m is None:
        raise EchostepError("--start is an index into --heights: with --heights auto there are none yet")
    if start is not None and given_m is not None and not 0 <= start < len(given_m):
        raise EchostepError(f"--start {start}: the floors of --heights are 0 to {len(given_m) - 1}")
    record = load_pressures(path, naming)
    for note in record.notes:
        console.print(f"{path}: {note}", markup=False)
    floors_ = _floors_of(path, record.samples, given_m, start)
    write_floors(out, floors_)
    if given_m is None:
        console.print("floors found: --heights " + ",".join(f"{h:g}" for h in floors_.heights_m))
    console.print(describe(floors_), markup=False)
    if picture is not None:
        draw_floors(picture, floors_, path.name)
    console.print(f"floors: {out}" + (f", picture: {picture}" if picture else ""), markup=False)


def record_floors(samples: Pressures, heights_m: Floats, start: int | None = None) -> Floors:
    """Floors at all samples (n,), each by the whole record: smoothed at about 10 Hz, with the noise measured on the record."""
    few, group = thinned(samples)
    prior = None if start is None else np.eye(len(heights_m))[start]
    whole = smooth_floors(few, heights_m, noise_of_record(samples, few), prior)
    return Floors(
        samples.t_s, whole.heights_m, whole.floor[group], whole.probability[group], whole.height_m[group], whole.up[group], whole.down[group]
    )  # fmt: skip


def _floors_of(path: Path, samples: Pressures, heights_m: Floats | None, start: int | None) -> Floors:
    """Floors of the record, with heights found from it where none are given; errors name the file."""
    try:
        if heights_m is None:
            few, _ = thinned(samples)
            heights_m = find_storeys(few, noise_of_record(samples, few))
        return record_floors(samples, heights_m, start)
    except EchostepError as error:
        raise EchostepError(f"{path}: {error}") from error


def parse_heights(text: str) -> Floats:
    """Heights (k,) of the floors from text such as "0,3.5,7"; raises EchostepError."""
    try:
        heights = [float(cell) for cell in text.split(",")]
    except ValueError as error:
        raise EchostepError(
            f"--heights {text}: metres with commas between are expected, as 0,3.5,7, or auto"
        ) from error
    return checked_heights(np.array(heights))


def draw_floors(path: Path, floors: Floors, title: str) -> None:
    """Draw the height over time, the heights of the floors, and the probability of each floor."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 6.5), dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    few = slice(None, None, max(1, len(floors.t_s) // MOST_POINTS))
    for k, height in enumerate(floors.heights_m):
        above.axhline(height, color="#cccccc", linewidth=0.8)
        above.text(1.005, height, f"{k}", transform=above.get_yaxis_transform(), va="center", fontsize=8)
    above.plot(floors.t_s[few], floors.height_m[few], color="#0072b2", linewidth=1.2, label="height")
    above.step(
        floors.t_s[few],
        floors.heights_m[floors.floor[few]],
        color="#009e73",
        where="post",
        linewidth=2,
        alpha=0.5,
        label="floor",
    )
    above.set_title(title, parse_math=False)
    above.set(ylabel="height / m")
    above.legend(fontsize=8)
    mesh = below.imshow(
        floors.probability[few].T, origin="lower", aspect="auto", vmin=0.0, vmax=1.0, cmap="Blues", interpolation="nearest",
        extent=(floors.t_s[0], floors.t_s[-1], -0.5, len(floors.heights_m) - 0.5),
    )  # fmt: skip
    below.set(xlabel="t / s", ylabel="floor")
    figure.colorbar(mesh, ax=below, label="probability")
    save_picture(figure, path)
