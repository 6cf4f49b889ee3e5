# SPDX-License-Identifier: MIT
"""`echostep plan import | check | show | overlay | edit`.

In: command-line arguments. Out: plans, pictures, findings. Owns the options. Heavy modules are imported when a command runs.
"""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from echostep.errors import EchostepError
from echostep_app.commands.options import Browser, Lang, example, out_option, picture_option, rectangle
from echostep_app.extras import PAGE, lacks, require
from echostep_app.printing.lines import say

if TYPE_CHECKING:
    from echostep.plan import Plan

MOST_LINES, MOST_MARKS = 200, 300  # findings that are printed, and that are drawn
MARK = b"echostep plan"  # in the header of the pictures that the drawing writes

app = typer.Typer(no_args_is_help=True, help="Plans: import, check, show, edit.")

Files = Annotated[
    list[Path],
    typer.Argument(metavar="FILE", help="A building in another format: a file or folder; DXF: one file a storey."),
]
Storey = Annotated[
    float, typer.Option("--storey", metavar="M", help="Height of a storey where the file has none.", min=1.0, max=50.0)
]
Layers = Annotated[
    list[str] | None,
    typer.Option(
        "--layer",
        metavar="KIND=PATTERN",
        help="DXF: layers of walls, columns, windows, doors, stairs, lifts, rooms or obstacles, as walls=A-WALL*; may be repeated.",
    ),
]
Unit = Annotated[
    str | None, typer.Option("--units", metavar="UNIT", help="DXF: mm, cm, m, in or ft instead of the file's.")
]
Scale = Annotated[
    str | None,
    typer.Option(
        "--scale",
        metavar="M|X0,Y0,X1,Y1=M",
        help="DXF, pictures: metres a unit (a pixel), or the distance of two known points in metres.",
    ),
]
Windows = Annotated[
    list[str] | None,
    typer.Option(
        "--window",
        metavar="X0,Y0,X1,Y1",
        help="DXF: this part of the drawing is a storey, in its units; may be repeated, the lowest first.",
    ),
]
Levels = Annotated[
    list[str] | None,
    typer.Option("--level", metavar="NAME", help="DXF: name of a storey; may be repeated, the lowest first."),
]
Align = Annotated[bool, typer.Option("--align", help="DXF: lay storeys that are drawn apart over each other.")]
Doors = Annotated[
    float | None,
    typer.Option(
        "--doors",
        metavar="M",
        help="IMDF: assume doors of this width where rooms or openings have none.",
        min=0.5,
        max=5.0,
    ),
]


@app.command("import", epilog=example("echostep plan import building.dxf --units mm -o plan.json"))
def import_(
    files: Files,
    out: Annotated[Path, out_option("PLAN", "The plan to write (JSON).")],
    storey: Storey = 3.5,
    layer: Layers = None,
    units: Unit = None,
    scale: Scale = None,
    window: Windows = None,
    level: Levels = None,
    align: Align = False,
    doors: Doors = None,
    picture: Annotated[bool, typer.Option("--picture/--no-picture", help="Draw the plan as PNG, beside it.")] = True,
) -> None:
    """Convert a building in another format to a plan, and show the imported and the omitted parts."""
    from echostep_app.commands.options import layers_of, scale_of, unit_of, windows_of
    from echostep_app.plan.importers.limited import import_reported
    from echostep_app.plan.importers.report import Hints
    from echostep_app.plan.importers.summary import summary
    from echostep_app.plan.questions import with_questions
    from echostep_app.plan.writer import save_plan

    layers, windows = layers_of(layer or []), windows_of(window or [])
    hints = Hints(storey, unit_of(units), layers, doors, scale_of(scale, units), windows, level or [], align)
    plan, report = import_reported(files[0], hints, files[1:])
    plan = with_questions(plan)
    save_plan(plan, out)
    for line in summary(plan, report):
        say(line)
    say(f"{out}{_pictured(plan, out) if picture else ''}{_asked(plan, out)}")


def _asked(plan: Plan, out: Path) -> str:
    """Words on the questions that an import leaves; empty without any."""
    count = sum(len(level.questions) for level in plan.levels)
    return f"; {count} question{'' if count == 1 else 's'} to answer: echostep plan edit {out}" if count else ""


def _pictured(plan: Plan, out: Path) -> str:
    """Draw a plan beside its file, in words; a picture that is not of this command stays as it is."""
    path = out.with_suffix(".png")
    if words := lacks("a picture", "matplotlib"):
        return f"; {words}"
    try:
        taken = path.exists() and MARK not in path.read_bytes()[:4096]
    except OSError:
        taken = True
    if taken:
        return f"; {path} is another picture and stays: echostep plan show {out} -o FILE.png draws this one"
    from echostep_app.plan.pictures.drawing import draw_plan

    return f", {path}{_without(draw_plan(plan, path, list(range(len(plan.levels)))))}"


def _without(letters: str) -> str:
    """Words on letters that were drawn as boxes; empty when there are none."""
    remedy = "install one that does (fonts-noto-cjk, fonts-noto)"
    return f"; no font here has the letters {letters[:40]}: {remedy}" if letters else ""


PlanFile = Annotated[Path, typer.Argument(metavar="PLAN", help="A plan (JSON), or what can be imported.")]


@app.command(epilog=example("echostep plan check plan.json --picture faults.png"))
def check(file: PlanFile, picture: Annotated[Path | None, picture_option("Draw what is wrong")] = None) -> None:
    """List the faults of a plan: exit status 0 without any, 1 otherwise."""
    from echostep_app.plan.check import check_plan
    from echostep_app.plan.importers.limited import open_limited
    from echostep_app.plan.pictures.drawing import draw_plan

    plan = open_limited(file)
    findings = check_plan(plan)
    for finding in findings[:MOST_LINES]:
        x, y = finding.position_m
        say(f"{finding.number}. {plan.levels[finding.level].name}, x {x:.2f} m, y {y:.2f} m: {finding.text}")
    if len(findings) > MOST_LINES:
        say(f"... and {len(findings) - MOST_LINES} more")
    counts = Counter(finding.kind for finding in findings)
    say(f"{file}: " + (", ".join(f"{count} x {kind}" for kind, count in counts.items()) or "nothing wrong"))
    if picture is not None:
        levels = sorted({finding.level for finding in findings}) or list(range(len(plan.levels)))
        say(f"picture: {picture}{_without(draw_plan(plan, picture, levels, None, findings[:MOST_MARKS]))}")
    if findings:
        raise typer.Exit(1)


@app.command()
def show(
    file: PlanFile,
    out: Annotated[Path, out_option("FILE", "The picture to write (PNG, SVG, PDF).")],
    level: Annotated[
        str | None, typer.Option("--level", metavar="NAME", help="One level, by name or index; all without it.")
    ] = None,
    bounds: Annotated[
        str | None, typer.Option("--bounds", metavar="X0,Y0,X1,Y1", help="Show this rectangle only, in metres.")
    ] = None,
) -> None:
    """Draw a plan."""
    require(str(out), "matplotlib")
    from echostep_app.plan.importers.limited import open_limited
    from echostep_app.plan.pictures.drawing import draw_plan

    plan = open_limited(file)
    levels = list(range(len(plan.levels))) if level is None else [_level(plan, level)]
    part = None if bounds is None else rectangle("--bounds", bounds, 1e6, "metres")
    say(f"picture: {out}{_without(draw_plan(plan, out, levels, part))}")


@app.command()
def overlay(file: PlanFile, out: Annotated[Path, out_option("FILE", "The overlay to write (.kmz).")]) -> None:
    """Make a picture of each storey that lies on the map: in ATAK (GRG), Google Earth, QGIS."""
    require(str(out), "matplotlib", "pyproj")
    from echostep_app.plan.importers.limited import open_limited
    from echostep_app.plan.pictures.overlay import write_overlays

    for made in write_overlays(open_limited(file), out):
        say(f"{made.name}: {made.south:.7f} to {made.north:.7f} N, {made.west:.7f} to {made.east:.7f} E")
    say(f"overlay: {out}")


@app.command()
def edit(
    file: Annotated[Path, typer.Argument(metavar="PLAN", help="A plan (JSON); one that does not exist begins empty.")],
    picture: Annotated[
        Path | None, typer.Option("--picture", metavar="IMAGE", help="Draw over this picture (PNG, JPEG, SVG).")
    ] = None,
    port: Annotated[
        int | None, typer.Option("--port", help="Port of the page [8420, or a free one].", min=0, max=65535)
    ] = None,
    browser: Browser = True,
    lang: Lang = None,
) -> None:
    """Clean a plan, draw walls and doors, name rooms on a page in the browser, until Ctrl-C."""
    require("the plan editor", *PAGE)
    from echostep_app.page.editor import edit_plan

    edit_plan(file, picture, port, lang.value if lang else None, browser=browser)


def _level(plan: Plan, name: str) -> int:
    names = [level.name for level in plan.levels]
    if name in names:
        return names.index(name)
    if name.isascii() and name.isdigit() and int(name) < len(names):
        return int(name)
    raise EchostepError(f"--level {name}: the levels are {', '.join(names)[:300]}")
