"""`echostep plan import | check | show`.

In: what the user typed. Out: plans, pictures, findings. Heavy imports wait until a command runs.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

app = typer.Typer(no_args_is_help=True, help="Plans: import, check, show.")


@app.command("import")
def import_(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A building in another format: file or folder.")],
    out: Annotated[Path, typer.Option("-o", "--out", metavar="PLAN", help="The plan to write (JSON).")],
    storey: Annotated[
        float,
        typer.Option("--storey", metavar="M", help="Height of a storey where the file has none.", min=1.0, max=50.0),
    ] = 3.5,
) -> None:
    """Make a plan of a building that is drawn in another format."""
    from echostep.building.formats import import_plan
    from echostep.plan_writer import save_plan

    plan = import_plan(file, storey)
    save_plan(plan, out)
    for level in plan.levels:
        counts = f"{len(level.walls)} walls, {len(level.windows)} windows, {len(level.doors)} doors, {len(level.rooms)} rooms"
        print(f"{level.name}, {level.height_m:g} m: {counts}")
    print(f"{len(plan.connectors)} stairs, lifts and ramps; {out}")
