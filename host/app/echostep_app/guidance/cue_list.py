# SPDX-License-Identifier: MIT
"""The cues of a run, to show, to speak and to keep.

In: cues in order of time. Out: the newest ones; cues.csv. Owns the list.
"""

from __future__ import annotations

from pathlib import Path

from echostep.file_mode import write_csv
from echostep_app.guidance.cues import Cue, Guide
from echostep_app.plan.routing import Route

CUE_COLUMNS = ("t_s", "kind", "arrow_rad", "left_m", "text", "spoken")


class CueList:
    """All cues since the start of a run."""

    def __init__(self) -> None:
        self.cues: list[Cue] = []
        self._returned = 0
        self._guide: Guide | None = None  # None as long as there is no route

    @property
    def cue(self) -> Cue | None:
        """The newest cue."""
        return self.cues[-1] if self.cues else None

    @property
    def route(self) -> Route | None:
        """The present route."""
        return self._guide.route if self._guide else None

    def news(self) -> list[Cue]:
        """The cues since the last call."""
        begin, self._returned = self._returned, len(self.cues)
        return self.cues[begin:]

    def write(self, path: Path) -> None:
        """All cues as CSV."""
        write_csv(path, CUE_COLUMNS, ([getattr(cue, name) for name in CUE_COLUMNS] for cue in self.cues))
