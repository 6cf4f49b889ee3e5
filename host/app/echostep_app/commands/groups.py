# SPDX-License-Identifier: MIT
"""Groups of options that several commands share: tracking, ports, output.

In: options as the command line parsed them. Out: dataclasses that make the arguments of the runs. Owns the groups; a command takes a group as one
parameter, and `with_groups` gives it the options.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass, fields, is_dataclass
from inspect import Parameter, Signature, signature
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_type_hints

from echostep.errors import EchostepError
from echostep_app.commands.options import (
    LOCAL,
    BeaconsPort,
    BoardPort,
    FootPort,
    Foxglove,
    GuideTo,
    Headless,
    Host,
    Keep,
    Lang,
    MtxPort,
    Name,
    OptionalPlan,
    Page,
    Port,
    Publish,
    Seconds,
    SettingsFile,
    Split,
    Start,
    StartSd,
    Team,
    page_address,
)
from echostep_app.printing.lines import say

if TYPE_CHECKING:
    from echostep_app.output.foxglove_live import FoxgloveAddress
    from echostep_app.page.server import Address
    from echostep_app.session.options import OutputOptions, PortOptions, TrackingOptions
    from echostep_app.team.endpoint import Outlet


def with_groups(command: Callable[..., None]) -> Callable[..., None]:
    """The same command with the options of its groups in the place of the parameters that take them."""
    hints = get_type_hints(command, include_extras=True)
    groups: dict[str, Any] = {name: kind for name, kind in hints.items() if is_dataclass(kind)}
    parameters: list[Parameter] = []
    for name, parameter in signature(command).parameters.items():
        if name in groups:
            kinds = get_type_hints(groups[name], include_extras=True)
            for f in fields(groups[name]):
                parameters.append(parameter.replace(name=f.name, default=f.default, annotation=kinds[f.name]))
        else:
            parameters.append(parameter.replace(annotation=hints[name]))

    def run(**given: Any) -> None:
        """Call the command with the groups that are made of the given options."""
        made = {name: kind(**{f.name: given.pop(f.name) for f in fields(kind)}) for name, kind in groups.items()}
        command(**given, **made)

    run.__name__, run.__doc__ = command.__name__, command.__doc__
    run.__annotations__ = {p.name: p.annotation for p in parameters}
    run.__signature__ = Signature(parameters)  # type: ignore[attr-defined]
    return run


@dataclass(frozen=True, slots=True)
class Tracking:
    """Tracking of a run: plan, start, settings, destination of the guidance."""

    plan: OptionalPlan = None
    start: Start = None
    start_sd: StartSd = None
    settings: SettingsFile = None
    guide: GuideTo = None

    def options(self, seed: int | None) -> TrackingOptions:
        """These options with the seed."""
        from echostep_app.session.options import TrackingOptions

        return TrackingOptions(self.plan, self.start, self.start_sd, self.settings, seed, self.guide)


@dataclass(frozen=True, slots=True)
class Ports:
    """The ports that a run reads, for how long, and how many recordings stay."""

    board: BoardPort = None
    mtx: MtxPort = None
    foot: FootPort = None
    beacons: BeaconsPort = None
    seconds: Seconds = None
    keep: Keep = None
    split: Split = None

    def options(self) -> PortOptions:
        """The given ports; without the board's, all are searched for and printed."""
        from echostep_app.recording.splitting import parse_split
        from echostep_app.session.options import PortOptions

        split = parse_split(self.split) if self.split is not None else None
        if self.board is not None or (self.foot or "").startswith("lines:"):
            return PortOptions(self.board, self.mtx, self.beacons, self.seconds, self.keep, self.foot, split)
        from echostep_app.commissioning.serial_ports import find_ports

        ports = find_ports(self.mtx, self.foot)
        options = {"board": ports.board, "mtx": ports.mtx, "foot": ports.foot}
        say("Ports: " + " ".join(f"--{name} {path}" for name, path in options.items() if path))
        if not ports.mtx and not ports.foot:
            say("Neither an MTx nor a foot board was found.")
        return PortOptions(ports.board, ports.mtx, self.beacons, self.seconds, self.keep, ports.foot, split)


@dataclass(frozen=True, slots=True)
class Output:
    """Where a run is shown and published."""

    headless: Headless = False
    page: Page = None
    host: Host = LOCAL
    port: Port = None
    lang: Lang = None
    publish: Publish = None
    name: Name = ""
    team: Team = "team"
    foxglove: Foxglove = None

    def options(self, folder: Path, *, stays_on_terminal: bool = False, browser: bool = False) -> OutputOptions:
        """These options with the folder of the results; `stays_on_terminal`: a run on a terminal keeps its page too."""
        from echostep_app.session.options import OutputOptions

        on_terminal = sys.stdout.isatty()
        return OutputOptions(
            folder,
            terminal=not self.headless,
            page=self._page_address(),
            page_stays=bool(self.page) or (stays_on_terminal and on_terminal),
            outlet=self._outlet(),
            browser=browser and on_terminal,
            foxglove=self._foxglove_address(),
        )

    def _page_address(self) -> Address | None:
        """Where to serve the page; None: no page."""
        if self.headless and self.page:
            raise EchostepError("--headless excludes --page: give one of the two")
        return None if self.headless else page_address(self.page, self.host, self.port, self.lang)

    def _outlet(self) -> Outlet | None:
        if not self.publish:
            return None
        from echostep_app.team.endpoint import parse_outlet

        return parse_outlet(self.publish, self.name, self.team)

    def _foxglove_address(self) -> FoxgloveAddress | None:
        if self.foxglove is None:
            return None
        from echostep_app.output.foxglove_live import parse_address

        return parse_address(self.foxglove)
