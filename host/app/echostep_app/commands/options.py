# SPDX-License-Identifier: MIT
"""Options that several commands share: their names, help and types; the grammar of those that describe a drawing.

In: nothing. Out: annotated types for the parameters of commands; what several of them mean. Owns nothing.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import typer

from echostep.errors import EchostepError
from echostep_app.extras import PAGE, lacks, require
from echostep_app.printing.lines import complain
from echostep_app.printing.picture_files import check_picture

if TYPE_CHECKING:
    from echostep_app.page.server import Address

Value = TypeVar("Value")


class Language(StrEnum):
    """Languages of the pages (`page/static/language.js`)."""

    EN = "en"
    DE = "de"


def needs(package: str) -> Callable[[typer.CallbackParam, Value], Value]:
    """A callback of an option that needs a package when it is given."""

    def checked(option: typer.CallbackParam, value: Value) -> Value:
        if value:
            require(option.opts[0], package)
        return value

    return checked


def picture_file(option: typer.CallbackParam, path: Path | None) -> Path | None:
    """A callback of an option that names a picture: its kind can be drawn, before anything else is done."""
    if path is not None:
        require(option.opts[0], "matplotlib")
        check_picture(path)
    return path


def example(line: str) -> str:
    """The end of a command's help: a command that can be typed, in one line."""
    return f"\b\nExample:\n  {line}"


def out_option(kind: str, text: str) -> Any:
    """The option of what a command writes: a folder (DIR), or a file."""
    return typer.Option("--out", "-o", metavar=kind, callback=lambda path: of_kind(path, kind == "DIR"), help=text)


def of_kind(path: Path | None, is_folder: bool) -> Path | None:
    """The same path; raises EchostepError where a file is given for a folder, or a folder for a file."""
    kinds = ("a file", "a folder")
    if path is not None and path.exists() and path.is_dir() != is_folder:
        raise EchostepError(f"{path}: is {kinds[path.is_dir()]}: --out is {kinds[is_folder]} here")
    return path


def picture_option(what: str) -> Any:
    """The option of a picture that is drawn besides."""
    return typer.Option("--picture", metavar="FILE", callback=picture_file, help=f"{what} (PNG, SVG, PDF).")


def page_address(page: bool | None, host: str, port: int | None, lang: Language | None = None) -> Address | None:
    """Where to serve the page; None: no page. An address that cannot be served is an error if given, a notice if it is the default."""
    if page:
        require("--page", *PAGE)
    if page is False:
        return None
    if words := lacks("the page", *PAGE):
        complain(f"No page is served: {words}")
        return None
    from echostep_app.page.server import Address

    return Address(host, port, lang.value if lang else None)


Columns = Annotated[
    str | None,
    typer.Option(
        "--columns",
        metavar="OURS=THEIRS,...",
        help="Names of the file's columns, as t_s=time,gx=gyro_x; those of common loggers are known without.",
    ),
]
Units = Annotated[
    str | None,
    typer.Option("--units", metavar="UNIT,...", help="Units of the file: ms, us, ns; g, mg; deg/s, deg; hPa, kPa."),
]
LOCAL = "127.0.0.1"
Thigh = Annotated[
    float | None, typer.Option("--thigh", metavar="M", help="Hip to knee, metres; without it, a usual adult's.")
]
Shank = Annotated[
    float | None, typer.Option("--shank", metavar="M", help="Knee to ankle or to the floor, metres; likewise.")
]
Plan = Annotated[Path, typer.Option("--plan", help="The building's plan (JSON, metres).")]
OptionalPlan = Annotated[
    Path | None,
    typer.Option(
        "--plan",
        help="The building's plan (JSON, metres). Without it the map begins where the walk begins, and nothing is drawn on it.",
    ),
]
Start = Annotated[
    str | None,
    typer.Option(
        "--start",
        metavar="X,Y,DEG[,LEVEL]|ROOM|?",
        help="Position and heading of the wearer at the start (level 0 is the plan's first, ? any), a room, or ? for anywhere.",
    ),
]
StartSd = Annotated[
    str | None,
    typer.Option("--start-sd", metavar="M,DEG", help="Standard deviations of the start: metres per axis, degrees."),
]
Browser = Annotated[
    bool, typer.Option("--open/--no-open", help="Open the page in a browser where there is one.", show_default=False)
]
Out = Annotated[Path, out_option("DIR", "Folder for track.csv, track.png and the recording.")]
SettingsFile = Annotated[Path | None, typer.Option("--settings", metavar="FILE", help="Settings (TOML).")]
Seed = Annotated[int, typer.Option("--seed", help="Seed of all random numbers.", min=0)]
RecordedSeed = Annotated[int | None, typer.Option("--seed", help="Seed; the recorded one by default.", min=0)]
Seconds = Annotated[float | None, typer.Option(help="Stop after this many seconds.", min=0.0)]
Headless = Annotated[bool, typer.Option("--headless", help="Neither terminal view nor page.")]
Page = Annotated[
    bool | None,
    typer.Option(
        "--page/--no-page",
        help="Serve the live page (the default; --page keeps it after the end of a replay), or do not.",
        show_default=False,
    ),
]
Host = Annotated[
    str,
    typer.Option(
        "--host", metavar="ADDRESS", help="Serve the page to other computers too; its URL then holds a token."
    ),
]
Port = Annotated[
    int | None, typer.Option("--port", help="TCP port of the page [8420, or a free one].", min=0, max=65535)
]
Lang = Annotated[
    Language | None,
    typer.Option("--lang", help="Language of the page; otherwise that of each browser.", show_default=False),
]
BoardCommand = Annotated[
    str | None,
    typer.Option(
        "--board-command",
        metavar="COMMAND",
        help="Program that simulates the sensor board; without it the board is simulated in Python.",
    ),
]
BoardPort = Annotated[
    str | None,
    typer.Option("--board", metavar="PORT", help="Serial port of the sensor board; without it, both are searched for."),
]
MtxPort = Annotated[
    str | None,
    typer.Option("--mtx", metavar="PORT", help="Serial port of the MTx; without one the board's leg gyros are used."),
]
FootPort = Annotated[
    str | None,
    typer.Option(
        "--foot",
        metavar="PORT",
        help="Serial port of a foot board, in the place of an MTx; lines:PORT, lines:tcp://..., lines:udp://..., lines:-: any IMU that prints lines.",
    ),
]
Foxglove = Annotated[
    str | None,
    typer.Option(
        "--foxglove",
        metavar="[HOST:]PORT",
        callback=needs("foxglove"),
        help="Serve estimates, echoes and the scene to Foxglove, as 8765; on this computer alone unless a host is given.",
    ),
]
Keep = Annotated[
    int | None,
    typer.Option(
        "--keep",
        metavar="N",
        help="Remove the oldest recordings of the folder until N are left; all are kept without it.",
        min=2,
    ),
]
Split = Annotated[
    str | None,
    typer.Option(
        "--split",
        metavar="SIZE|TIME",
        help="Begin a new file of the recording after so much, as 500MB, 2GB, 30min or 1h; replay takes them as one.",
    ),
]
Publish = Annotated[
    list[str] | None,
    typer.Option(
        "--publish",
        metavar="URL",
        help="Send estimates to a commander: mqtt:// mqtts:// cot+udp:// cot+tcp:// cot+tls://; may be given several times.",
    ),
]
Name = Annotated[str, typer.Option("--name", help="The wearer's name, for --publish.")]
Team = Annotated[str, typer.Option("--team", help="The team's name, for --publish.")]
BeaconsPort = Annotated[
    str | None,
    typer.Option("--beacons", metavar="PORT", help="Port of a beacon gateway: serial, or udp://127.0.0.1:9000."),
]
GuideTo = Annotated[
    str | None,
    typer.Option("--guide", metavar="TO", help="Guide the wearer to a room, X,Y[,LEVEL], or exit: the nearest."),
]


FARTHEST = 1e12  # of a coordinate in drawing units: millimetres of a national grid are below 1e10


def unit_of(name: str | None) -> str | None:
    """A unit that drawings may have."""
    from echostep_app.plan.importers.dxf.frame import METRES

    if name is not None and name not in METRES:
        raise EchostepError(f"--units {name}: expected one of {', '.join(METRES)}")
    return name


def layers_of(texts: Sequence[str]) -> dict[str, list[str]]:
    """Patterns of layers by kind."""
    from echostep_app.plan.importers.dxf.layers import LAYERS

    layers: dict[str, list[str]] = {}
    for text in texts:
        kind, _, pattern = text.partition("=")
        if kind not in LAYERS or not pattern:
            raise EchostepError(f"--layer {text}: expected KIND=PATTERN with KIND one of {', '.join(LAYERS)}")
        layers.setdefault(kind, []).append(pattern)
    return layers


def scale_of(text: str | None, units: str | None) -> float | None:
    """Metres a unit: given as such, or as two points of the drawing and their distance in metres."""
    if text is None:
        return None
    if units is not None:
        raise EchostepError(f"--scale {text}: give --scale or --units, not both")
    points, equals, distance = text.partition("=")
    wrong = EchostepError(
        f"--scale {text}: expected metres a unit, as 0.0254, or two points and their distance, as 0,0,1250,0=8.5"
    )
    try:
        metres = float(distance if equals else text)
        x0, y0, x1, y1 = (float(part) for part in points.split(",")) if equals else (0.0, 0.0, 1.0, 0.0)
        scale = metres / math.dist((x0, y0), (x1, y1))
    except (ValueError, ZeroDivisionError) as error:
        raise wrong from error
    if not 1e-6 <= scale <= 1e4:
        raise wrong
    return scale


def windows_of(texts: Sequence[str]) -> list[tuple[float, float, float, float]]:
    """Rectangles in drawing units."""
    return [rectangle("--window", text, FARTHEST, "drawing units") for text in texts]


def rectangle(option: str, text: str, farthest: float, units: str) -> tuple[float, float, float, float]:
    """X0,Y0,X1,Y1 as numbers."""
    try:
        x0, y0, x1, y1 = (float(part) for part in text.split(","))
    except ValueError as error:
        raise EchostepError(f"{option} {text}: expected X0,Y0,X1,Y1 in {units}") from error
    if not (abs(x0) < farthest and abs(y0) < farthest and x0 < x1 < farthest and y0 < y1 < farthest):
        raise EchostepError(f"{option} {text}: expected X0 < X1 and Y0 < Y1")
    return x0, y0, x1, y1
