# SPDX-License-Identifier: MIT
"""The true path of a walk: from a file that `echostep score` reads, or from the recording that carries it.

In: a file, a recording's metadata; estimates. Out: `ScoredPath`, metadata, the `Scorecard` of estimates. Owns the field of the metadata.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np
from msgspec import Meta

from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep.localization import Estimate
from echostep.plan import Plan
from echostep.recording import MCAP_MAGIC, Recording, open_recording
from echostep.walk.recorded import START_LIMIT_M, Coordinate
from echostep_app.printing.lines import as_error
from echostep_app.scorecard.card import GAP_S, Scorecard, score
from echostep_app.scorecard.track_columns import ScoredPath, levels_at, load_path, track_of

FIELD = "truth"  # of a recording's metadata
MOST_BYTES = 900_000  # of the field: a larger record of metadata is not read [echostep.recording.damage.scan]
Column = Annotated[list[Coordinate], Meta(min_length=1)]


class RecordedTruth(msgspec.Struct, omit_defaults=True):
    """The field `truth`: the true path on the recording's clock; heights (m) and numbers of floors where they are known."""

    t_s: Column
    x_m: Column
    y_m: Column
    z_m: Column | None = None
    level: Column | None = None


def is_recording(path: Path) -> bool:
    """Whether a file begins as a recording; raises EchostepError when it cannot be read."""
    with as_error(f"{path}: cannot read it"), path.open("rb") as file:
        return file.read(len(MCAP_MAGIC)) == MCAP_MAGIC


def load_truth(path: Path, plan: Plan | None) -> ScoredPath:
    """The true path in a file, or in the recording `path`; raises EchostepError."""
    truth = recorded_truth(open_recording(path), plan) if is_recording(path) else load_path(path, plan)
    if truth is None:
        raise EchostepError(f"{path}: no true path in it: give one with --truth FILE")
    return truth


def recorded_truth(recording: Recording, plan: Plan | None) -> ScoredPath | None:
    """The true path that a recording carries, None without; raises EchostepError when it is damaged."""
    text = recording.metadata.get(FIELD)
    if text is None:
        return None
    try:
        truth = msgspec.json.decode(text, type=RecordedTruth)
        columns = {name: np.array(values) for name, values in msgspec.structs.asdict(truth).items() if values}
        if len({len(column) for column in columns.values()}) > 1 or (np.diff(columns["t_s"]) < 0.0).any():
            raise ValueError
    except (ValueError, RecursionError, msgspec.MsgspecError) as error:
        raise EchostepError(f"{recording.path}: its true path is damaged: give one with --truth FILE") from error
    t_s, height_m = columns["t_s"], columns.get("z_m")
    level = columns.get("level", levels_at(height_m, len(t_s), plan) if plan else None)
    xy_m = np.column_stack([columns["x_m"], columns["y_m"]])
    return ScoredPath(recording.path, t_s, xy_m, np.zeros(len(t_s), bool), {}, height_m, level)


def truth_field(truth: ScoredPath, samples_s: Floats, name: str) -> tuple[dict[str, str], str]:
    """The metadata that carry a true path with samples at these times (n,) of the file `name`, and the same in words; raises EchostepError."""
    begin_s, end_s = samples_s[0], samples_s[-1]
    within = (truth.t_s > begin_s - GAP_S) & (truth.t_s < end_s + GAP_S)
    if not within.any():
        raise EchostepError(
            f"{truth.path}: no row from {begin_s:g} to {end_s:g} s, the time of {name}: both need the same clock"
        )
    optional = {"z_m": truth.height_m, "level": truth.level}
    known = {name: column for name, column in optional.items() if column is not None and np.isfinite(column).all()}
    columns = {"t_s": truth.t_s - begin_s, "x_m": truth.xy_m[:, 0], "y_m": truth.xy_m[:, 1], **known}
    rows = {name: np.round(column[within], 4) for name, column in columns.items()}
    if any(np.abs(column).max() >= START_LIMIT_M for column in rows.values()):
        raise EchostepError(
            f"{truth.path}: a place or time beyond {START_LIMIT_M:g} m: metres of the plan are expected, and seconds"
        )
    every = 1
    while len(text := _text(rows, every)) > MOST_BYTES:
        every *= 2
    words = f"truth: {within.sum()} rows of {truth.path.name}" + (f", every {every}th kept" if every > 1 else "")
    return {FIELD: text}, words


def _text(rows: dict[str, Floats], every: int) -> str:
    """The field of every so many rows."""
    return msgspec.json.encode({name: column[::every].tolist() for name, column in rows.items()}).decode()


def card_of(estimates: Sequence[Estimate], truth: ScoredPath) -> Scorecard | None:
    """The scores of estimates, as `echostep score` gives them; None where they have no moment in common with the truth."""
    try:
        return score(track_of(estimates), truth) if estimates else None
    except EchostepError:
        return None
