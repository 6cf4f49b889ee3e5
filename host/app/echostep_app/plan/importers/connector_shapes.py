# SPDX-License-Identifier: MIT
"""Stairs, lifts and ramps that lie above each other -> connectors.

In: the `ConnectorShape`s of all levels. Out: `Connector`s. Owns nothing. Stairs and ramps connect neighbouring levels; a lift may pass levels.
"""

from __future__ import annotations

from collections.abc import Sequence

from shapely.geometry import Polygon

from echostep.plan import Connector, Georeference, Plan
from echostep_app.plan.importers.drawn_level import ConnectorShape, DrawnLevel, areas, ring
from echostep_app.plan.importers.report import ImportReport

SHARED = 0.4  # shapes that share more than this part of the smaller area are one staircase; assumed


def plan_of(
    name: str, drawn_levels: Sequence[DrawnLevel], report: ImportReport, georeference: Georeference | None = None
) -> Plan:
    """The plan of levels, from the lowest, and the connectors between them."""
    levels = tuple(drawn.level() for drawn in drawn_levels)
    return Plan(name[:80], levels, None, "", join_connectors(drawn_levels, report), georeference)


def join_connectors(drawn_levels: Sequence[DrawnLevel], report: ImportReport) -> tuple[Connector, ...]:
    """The connectors between levels; the outline is the intersection of their shapes. Shapes that join no two levels are reported."""
    chains: list[_ConnectorChain] = []
    for i, drawn in enumerate(drawn_levels):
        for shape in drawn.connectors:
            chain = next((chain for chain in chains if chain.continues(shape, i)), None)
            if chain is None:
                chains.append(_ConnectorChain(shape, i))
            else:
                chain.add(shape, i)
    joining = [chain for chain in chains if len(chain.levels) > 1]
    for chain in chains:
        report.leave_out(f"{chain.kind} on one level only", len(chain.levels) == 1)
    return tuple(_connector(chain, joining) for chain in joining)


class _ConnectorChain:
    """One staircase or shaft, collected from the lowest level upwards."""

    def __init__(self, shape: ConnectorShape, level: int) -> None:
        self.kind, self.name, self.area = shape.kind, shape.name, shape.area
        self.levels = sorted({level, *shape.levels})

    def continues(self, shape: ConnectorShape, level: int) -> bool:
        """Whether the shape is the same staircase one level higher, or the same lift any number of levels higher."""
        if shape.kind != self.kind or (self.kind != "lift" and level - self.levels[-1] > 1):
            return False
        common = shape.area.intersection(self.area)
        return bool(common.area > SHARED * min(shape.area.area, self.area.area))

    def add(self, shape: ConnectorShape, level: int) -> None:
        """Extend the chain to a level by its shape there."""
        common = max(areas([shape.area.intersection(self.area)]), key=lambda part: part.area, default=None)
        self.area = common if isinstance(common, Polygon) else self.area
        self.name = self.name or shape.name
        self.levels = sorted({*self.levels, level, *shape.levels})


def _connector(chain: _ConnectorChain, chains: list[_ConnectorChain]) -> Connector:
    number = 1 + [other for other in chains if other.kind == chain.kind].index(chain)
    return Connector(chain.kind, chain.name or f"{chain.kind} {number}", tuple(chain.levels), ring(chain.area))
