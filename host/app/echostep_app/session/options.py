# SPDX-License-Identifier: MIT
"""Options that several commands share, as the command line parsed them.

In: values of command-line options. Out: frozen dataclasses. Owns nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from echostep_app.output.foxglove_live import FoxgloveAddress
    from echostep_app.page.server import Address
    from echostep_app.recording.splitting import SplitLimit
    from echostep_app.team.endpoint import Outlet


@dataclass(frozen=True, slots=True)
class OutputOptions:
    """Where the results of a tracked run go: files in `folder`, the terminal view, the page, a commander."""

    folder: Path
    terminal: bool = True
    page: Address | None = None  # address to serve the page at; None: no page
    page_stays: bool = False  # serve the page until Ctrl-C after the run is over
    outlet: Outlet | None = None  # where estimates are published; None: nowhere
    browser: bool = False  # open the page in a browser, if installed
    foxglove: FoxgloveAddress | None = None  # where viewers of Foxglove's protocol connect; None: nowhere

    @property
    def watched(self) -> bool:
        """Whether the run is shown, on the terminal or on the page."""
        return self.terminal or self.page is not None


@dataclass(frozen=True, slots=True)
class TrackingOptions:
    """Inputs of the tracker. None is replaced by the value of the plan, of the recording, or by the default."""

    plan_path: Path | None  # None: tracked without a plan
    start: str | None = None  # as given: X,Y,DEG[,LEVEL], a room, or ?
    start_sd: str | None = None  # as given: M,DEG
    settings_path: Path | None = None
    seed: int | None = None
    guide_to: str | None = None  # destination of the guidance; None: no guidance


@dataclass(frozen=True, slots=True)
class PortOptions:
    """Ports to read, as serial ports or pyserial URLs, for how long, and how many recordings stay."""

    board: str | None
    mtx: str | None = None
    beacons: str | None = None
    seconds: float | None = None  # None: until Ctrl-C
    keep: int | None = None  # recordings to keep in the folder; None: all
    foot: str | None = None  # of a foot board, in the place of an MTx; lines:PORT: of any IMU, which needs no board
    split: SplitLimit | None = None  # of the recording into parts
