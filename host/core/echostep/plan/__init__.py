# SPDX-License-Identifier: MIT
"""The building's plan, as plan.json holds it.

In: a plan file. Out: `Plan`: levels of walls, doors, rooms and connectors, in metres (map frame). Owns the file format.
"""

from echostep.plan.model import (
    ANY_LEVEL,
    FORMAT_VERSION,
    NO_PLAN,
    Connector,
    Georeference,
    Level,
    Plan,
    Pose,
    Question,
    Room,
    is_no_plan,
    load_plan,
    parse_plan,
    sides,
)
from echostep.plan.plan_file import ConnectorKind, Door, DoorState
