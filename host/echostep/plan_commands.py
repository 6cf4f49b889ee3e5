"""`echostep plan import | check | show`.

In: what the user typed. Out: plans, pictures, findings. Heavy imports wait until a command runs.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from echostep.errors import EchostepError

app = typer.Typer(no_args_is_help=True, help="Plans: import, check, show.")


Files = Annotated[
    list[Path],
    typer.Argument(metavar="FILE", help="A building in another format: a file or folder; DXF: one file a storey."),
]


@app.command("import")
def import_(
    files: Files,
    out: Annotated[Path, typer.Option("-o", "--out", metavar="PLAN", help="The plan to write (JSON).")],
    storey: Annotated[
        float,
        typer.Option("--storey", metavar="M", help="Height of a storey where the file has none.", min=1.0, max=50.0),
    ] = 3.5,
    layer: Annotated[
        list[str] | None,
        typer.Option(
            "--layer",
            metavar="KIND=PATTERN",
            help="DXF: layers of walls, windows, doors, stairs, lifts, rooms or obstacles, as walls=A-WALL*; may be repeated.",
        ),
    ] = None,
    units: Annotated[
        str | None, typer.Option("--units", metavar="UNIT", help="DXF: mm, cm, m, in or ft instead of the file's.")
    ] = None,
) -> None:
    """Make a plan of a building that is drawn in another format."""
    from echostep.building.formats import Hints, import_plan
    from echostep.plan_writer import save_plan

    plan = import_plan(files[0], Hints(storey, _unit(units), _layers(layer or [])), files[1:])
    save_plan(plan, out)
    for level in plan.levels:
        counts = f"{len(level.walls)} walls, {len(level.windows)} windows, {len(level.doors)} doors, {len(level.rooms)} rooms"
        print(f"{level.name}, {level.height_m:g} m: {counts}")
    print(f"{len(plan.connectors)} stairs, lifts and ramps; {out}")


def _unit(name: str | None) -> str | None:
    from echostep.building.dxf_entities import METRES

    if name is not None and name not in METRES:
        raise EchostepError(f"--units {name}: expected one of {', '.join(METRES)}")
    return name


def _layers(texts: list[str]) -> dict[str, list[str]]:
    from echostep.building.dxf import LAYERS

    layers: dict[str, list[str]] = {}
    for text in texts:
        kind, _, pattern = text.partition("=")
        if kind not in LAYERS or not pattern:
            raise EchostepError(f"--layer {text}: expected KIND=PATTERN with KIND one of {', '.join(LAYERS)}")
        layers.setdefault(kind, []).append(pattern)
    return layers
