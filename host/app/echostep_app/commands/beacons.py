# SPDX-License-Identifier: MIT
"""`echostep beacons simulate`: simulated beacons and their gateway, to try a tracker without any.

In: the command's options. Out: frames on a port. Slow imports wait until the command runs.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from echostep_app.commands.options import Seed

app = typer.Typer(no_args_is_help=True, help="Beacons: a simulated gateway.")


@app.callback()
def beacons() -> None:
    """Beacons: a simulated gateway."""


@app.command()
def simulate(
    plan: Annotated[Path, typer.Option("--plan", help="The building's plan: walls hide beacons.")],
    truth: Annotated[
        Path, typer.Option("--truth", metavar="FILE", help="Path of the wearer: CSV t_s,x,y,heading_rad.")
    ],
    to: Annotated[
        str, typer.Option("--to", metavar="PORT", help="udp://HOST:PORT[?key=FILE], or a serial port.")
    ] = "udp://127.0.0.1:9000",
    spacing: Annotated[
        float, typer.Option("--spacing", metavar="M", help="Distance between beacons along the walk.", min=0.5)
    ] = 5.0,
    pace: Annotated[float, typer.Option("--pace", help="Speed, as a multiple of real time.", min=0.01)] = 1.0,
    seed: Seed = 1,
) -> None:
    """Simulate beacons along a walk, and send their measurements as their gateway does, in real time."""
    from echostep_app.commands.actions.beacon_player import simulate_gateway

    simulate_gateway(plan, truth, to, spacing, pace, seed)
