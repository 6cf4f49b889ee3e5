"""Stairs, lifts and ramps that lie over each other -> connectors.

In: the storeys' `Way` shapes. Out: `Connector`s. Stairs and ramps join storeys that follow each other; a lift may pass one without stopping.
"""

from __future__ import annotations

from collections.abc import Sequence

from shapely.geometry import Polygon

from echostep.plan.importers.storey import Storey, Way, areas, ring
from echostep.plan.model import Connector

SHARED = 0.4  # of the smaller area: then it is the same staircase


def connect(storeys: Sequence[Storey]) -> tuple[Connector, ...]:
    """The ways between storeys; the outline is what all their shapes have in common."""
    chains: list[_Chain] = []
    for i, storey in enumerate(storeys):
        for way in storey.ways:
            chain = next((chain for chain in chains if chain.goes_on(way, i)), None)
            if chain is None:
                chains.append(_Chain(way, i))
            else:
                chain.add(way, i)
    joining = [chain for chain in chains if len(chain.levels) > 1]
    return tuple(_connector(chain, joining) for chain in joining)


def same_place(one: Polygon, other: Polygon) -> bool:
    """Whether two areas on different storeys lie over each other."""
    return bool(one.intersection(other).area > SHARED * min(one.area, other.area))


class _Chain:
    """One staircase or shaft, from below."""

    def __init__(self, way: Way, level: int) -> None:
        self.kind, self.name, self.area = way.kind, way.name, way.area
        self.levels = sorted({level, *way.levels})

    def goes_on(self, way: Way, level: int) -> bool:
        """Whether it is the same one, a storey (a lift: any number of storeys) higher."""
        if way.kind != self.kind or (self.kind != "lift" and level - self.levels[-1] > 1):
            return False
        return same_place(way.area, self.area)

    def add(self, way: Way, level: int) -> None:
        """The chain reaches this storey."""
        common = max(areas([way.area.intersection(self.area)]), key=lambda part: part.area, default=None)
        self.area = common if isinstance(common, Polygon) else self.area
        self.name = self.name or way.name
        self.levels = sorted({*self.levels, level, *way.levels})


def _connector(chain: _Chain, chains: list[_Chain]) -> Connector:
    number = 1 + [other for other in chains if other.kind == chain.kind].index(chain)
    return Connector(chain.kind, chain.name or f"{chain.kind} {number}", tuple(chain.levels), ring(chain.area))
