# SPDX-License-Identifier: MIT
"""`echostep.replay`: a recorded walk tracked again, for programs and notebooks.

In: a recording, its plan. Out: `Walk`: the estimates, as a table of numpy or pandas, and as a picture. Owns nothing. The stages and the estimates
are those of `echostep replay`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from echostep.additions import added, needed, svg_of
from echostep.errors import EchostepError
from echostep.localization import Estimate, Start, TrackStatus
from echostep.plan import NO_PLAN, Plan, Pose, load_plan
from echostep.recording import open_parts
from echostep.settings import Settings
from echostep.walk.recorded import shown_name, tracker_of
from echostep.walk.table import COLUMNS, PLACE, columns_of, refuse_none

if TYPE_CHECKING:
    from pandas import DataFrame


@dataclass(frozen=True, slots=True, repr=False)
class Walk:
    """The estimates of a walk on its plan, in order of time; a notebook shows it as a picture.

    >>> import echostep
    >>> walk = echostep.replay("walk.mcap", "demo.json")
    >>> walk.to_numpy()["x_m"].round(2)
    array([2., 2., 2., 2., 2.])
    >>> table = walk.to_pandas()
    >>> table.index.name, list(table.columns[:3])
    ('t_s', ['x_m', 'y_m', 'heading_rad'])
    >>> walk.draw("track.pdf")
    """

    name: str
    plan: Plan
    estimates: tuple[Estimate, ...]

    def to_numpy(self) -> NDArray[np.void]:
        """A structured array (n,) with the columns of track.csv; each name ends in its unit, `status` is text. Lists are in `estimates`.

        On a plan with a georeference also `longitude_deg` and `latitude_deg`, NaN where the place is not known.
        """
        values = columns_of(list(self.estimates), self.plan)
        names = [*COLUMNS, *(name for name in PLACE if name in values)]
        columns = {name: np.array(values[name], float if name in PLACE else None) for name in names}
        table = np.empty(len(self.estimates), [(name, column.dtype) for name, column in columns.items()])
        for name, column in columns.items():
            table[name] = column
        return table

    def to_pandas(self) -> DataFrame:
        """The same columns with the time `t_s` (s) as the index; needs pandas: pip install 'echostep[pandas]'."""
        try:
            from pandas import DataFrame
        except ModuleNotFoundError as error:
            raise EchostepError(
                "to_pandas needs pandas, which is not installed: pip install 'echostep[pandas]'"
            ) from error

        return DataFrame(self.to_numpy()).set_index("t_s")

    def draw(self, path: Path | str) -> None:
        """Write the picture of track.png as PNG, SVG or PDF, by the ending of the name."""
        needed("pictures", "a picture").save(self, Path(path))

    def __repr__(self) -> str:
        """Name, number and duration of the estimates, share of them that is `tracking`."""
        tracking = sum(e.status is TrackStatus.TRACKING for e in self.estimates) / len(self.estimates)
        span_s = self.estimates[-1].t_s - self.estimates[0].t_s
        return f"<Walk {self.name!r}: {len(self.estimates)} estimates, {span_s:.1f} s, {tracking:.0%} tracking, on {self.plan.name!r}>"

    def _repr_svg_(self) -> str | None:
        """The picture for a notebook; None without matplotlib, so that the repr is shown."""
        return svg_of(self)


def replay(
    recording: Path | str | Sequence[Path | str],
    plan: Plan | Path | str | None = None,
    *,
    start: Start | Pose | None = None,
    settings: Settings | Path | str | None = None,
    seed: int | None = None,
) -> Walk:
    """Track a recording, in one file or in parts, on a plan, or without one (None).

    Start, settings (also a TOML file) and seed are the recorded ones unless given. Raises EchostepError when a file cannot be read, and for a
    recording without estimates.

    >>> import echostep
    >>> echostep.replay("walk.mcap", "demo.json", seed=7)
    <Walk 'walk.mcap': 5 estimates, 2.0 s, 100% tracking, on 'Demo office'>
    """
    paths = [recording] if isinstance(recording, Path | str) else recording
    opened = open_parts([Path(path) for path in paths])
    importer = added("plans") or load_plan  # plans of other formats, if a distribution adds importers
    on = NO_PLAN if plan is None else plan if isinstance(plan, Plan) else importer(Path(plan))
    tracker = tracker_of(opened, on, start, settings, seed)
    estimates = [e for portion in opened.portions() for e in tracker.take(portion)]
    refuse_none(estimates, opened.path)
    return Walk(shown_name(opened.path, opened.metadata), on, tuple(estimates))
