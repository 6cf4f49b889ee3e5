"""The scene: everything that a page shows of one moment, immutable.

In: a tracker, in the tracker's thread. Out: `PageScene`s that any thread may read. Owns nothing; all arrays are copies.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from echostep.arrays import Octets
from echostep.localization.estimate import Estimate, TrackStatus
from echostep.page.elements.beacon_marks import Mark
from echostep.page.elements.echo_lines import Beam
from echostep.page.elements.guidance import Guidance
from echostep.page.elements.stream_rates import StreamRates
from echostep.tracker_state import Particles

KNOWN_HEADING_RAD = 1.0  # beyond this standard deviation the arrow is a circle
MOST_SHOWN = 10_000


@dataclass(frozen=True, slots=True)
class Specks:
    """A cloud as it is drawn: `x_m`, `y_m` (n,) float32 in the map, `weight` (n,) uint8, 255 for the greatest, `level` (n,) uint8."""

    x_m: NDArray[np.float32]
    y_m: NDArray[np.float32]
    weight: Octets
    level: Octets

    def moved(self, dx_m: float, dy_m: float) -> Specks:
        """The cloud elsewhere."""
        return replace(self, x_m=self.x_m + np.float32(dx_m), y_m=self.y_m + np.float32(dy_m))


@dataclass(frozen=True, slots=True)
class PageScene:
    """One moment: `walked` points of the trail belong to it; `born_ns` is the host's monotonic clock when its bytes had come.

    `guidance` is the run's; a page's own destination is the session's.
    """

    born_ns: int
    t_s: float
    told: Estimate | None
    specks: Specks | None
    beams: tuple[Beam, ...]
    streams: StreamRates | None
    walked: int
    words: str
    marks: tuple[Mark, ...] = ()
    guidance: Guidance | None = None


def specks(particles: Particles) -> Specks:
    """Particles as they are drawn."""
    weight = np.exp(particles.log_weight)
    shown = (255.0 * weight / max(float(weight.max()), 1e-300)).astype(np.uint8)
    x_m, y_m = particles.x_m.astype(np.float32), particles.y_m.astype(np.float32)
    return Specks(x_m, y_m, shown, np.minimum(particles.level, 255).astype(np.uint8))


def words(told: Estimate | None, *, waits: bool = False, taps: bool = True) -> str:
    """How far to trust a position, in words; `waits`: for somebody to say where he is; `taps`: one can say so on the page."""
    if told is None:
        return "tap where you stand to start" if waits else "waiting for the foot to stand still"
    if told.status == TrackStatus.LOST:
        return "lost: walk along a wall or tap where you are" if taps else "lost"
    return f"{told.status.value}, {metres(told.ellipse95.major_m)}"


def metres(distance_m: float) -> str:
    """A length as people say it: 0.2 m, 3 m, 40 m."""
    return f"{distance_m:.1f} m" if distance_m < 0.95 else f"{distance_m:.0f} m"
