"""The building's plan: plan.json, its checks, its drawing, ways through it, and what other programs call a plan.

In: plan files. Out: `Plan`: levels of walls, doors, rooms and connectors, in metres (map frame). Owns the file format and everything that
needs shapely. `importers` turns drawings and maps of other programs into such files.
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
