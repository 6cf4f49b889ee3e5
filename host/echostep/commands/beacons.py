"""`echostep beacons ...`: simulated beacons and their gateway, for trying a tracker without any. Heavy imports wait until a command runs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

app = typer.Typer(no_args_is_help=True, help="Beacons: a simulated gateway.")


@app.callback()
def beacons() -> None:
    """Beacons: a simulated gateway."""


@app.command()
def simulate(
    plan: Annotated[Path, typer.Option("--plan", help="The building's plan: walls hide beacons.")],
    truth: Annotated[
        Path, typer.Option("--truth", metavar="FILE", help="Where the wearer is: CSV t_s,x,y,heading_rad.")
    ],
    to: Annotated[
        str, typer.Option("--to", metavar="PORT", help="udp://HOST:PORT, or a serial port.")
    ] = "udp://127.0.0.1:9000",
    spacing: Annotated[
        float, typer.Option("--spacing", metavar="M", help="Between beacons along the walk.", min=0.5)
    ] = 5.0,
    pace: Annotated[float, typer.Option("--pace", help="Times real time.", min=0.01)] = 1.0,
    seed: Annotated[int, typer.Option("--seed", help="Seed of everything random.", min=0)] = 1,
) -> None:
    """Play a beacon gateway for a walk: beacons along it, what they measure sent in real time."""
    from echostep.commands.beacon_player import simulate_gateway

    simulate_gateway(plan, truth, to, spacing, pace, seed)
