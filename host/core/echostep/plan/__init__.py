# SPDX-License-Identifier: MIT
"""The building's plan: plan.json, its checks, its drawing, routes through it, and importers of other formats.

In: plan files; drawings and maps of other programs (`importers`). Out: `Plan`: levels of walls, doors, rooms and connectors, in metres (map frame).
Owns the file format and everything that needs shapely.
"""

from echostep.plan.model import (
    Connector,
    ConnectorKind,
    Door,
    DoorState,
    Georeference,
    Level,
    Plan,
    Pose,
    Room,
    load_plan,
    parse_plan,
)

__all__ = [
    "Connector",
    "ConnectorKind",
    "Door",
    "DoorState",
    "Georeference",
    "Level",
    "Plan",
    "Pose",
    "Room",
    "load_plan",
    "parse_plan",
]
