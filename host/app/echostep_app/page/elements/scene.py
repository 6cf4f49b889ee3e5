# SPDX-License-Identifier: MIT
"""The scene: everything that a page shows of one moment, immutable.

In: a tracker, in the tracker's thread. Out: `PageScene`s that any thread may read. Owns nothing; all arrays are copies.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from echostep.arrays import Floats, Octets
from echostep.localization import Estimate, TrackStatus
from echostep.particles.limits import PROBABLE
from echostep.plan import Plan
from echostep.tracker.state import ParticleSnapshot
from echostep_app.page.elements.alarm import ShownAlarm
from echostep_app.page.elements.echo_lines import EchoLine
from echostep_app.page.elements.guidance import ShownGuidance
from echostep_app.page.elements.marks import BeaconMark, ShownMeeting
from echostep_app.page.elements.stream_rates import StreamRates
from echostep_app.page.elements.undo_offer import UndoOffer
from echostep_app.scorecard.track_columns import ScoredPath
from echostep_app.wearer.steady_status import elsewhere, fitting, other_floor

MOST_SHOWN = 10_000  # particles in a frame


SHOWN_HEIGHT_M = 1.5  # least height against the start that a page shows: half a storey


@dataclass(frozen=True, slots=True)
class ParticleSample:
    """Particles to draw: `x_m`, `y_m` (n,) float32 in the map, `weight` (n,) uint8, 255 for the greatest, `level` (n,) uint8."""

    x_m: NDArray[np.float32]
    y_m: NDArray[np.float32]
    weight: Octets
    level: Octets

    def moved(self, dx_m: float, dy_m: float) -> ParticleSample:
        """The same particles, shifted."""
        return replace(self, x_m=self.x_m + np.float32(dx_m), y_m=self.y_m + np.float32(dy_m))


@dataclass(frozen=True, slots=True)
class PageScene:
    """The state that a page shows of one moment.

    `arrived_ns`: host's monotonic clock when the bytes of the estimate arrived. `trail_count`: number of points of the trail up to this moment.
    `guidance`: of the run; the page's session adds guidance to a destination chosen on the page. `echoes_fit`: the plan explains the last echoes.
    `truth`: the true position, where it is known. `gait`: that the wearer runs, in words. `numbers`: of the places that fit (`PlaceNumbers`).
    """

    arrived_ns: int
    t_s: float
    estimate: Estimate | None
    particles: ParticleSample | None
    echo_lines: tuple[EchoLine, ...]
    streams: StreamRates | None
    trail_count: int
    status_text: str
    beacons: tuple[BeaconMark, ...] = ()
    undo: UndoOffer | None = None
    echoes_fit: bool = False
    guidance: ShownGuidance | None = None
    truth: TruePosition | None = None
    alarm: ShownAlarm | None = None
    met: ShownMeeting | None = None
    gait: str = ""
    numbers: tuple[int, ...] = ()


def is_placed(estimate: Estimate, plan: Plan) -> bool:
    """Whether an estimate is shown as a place; without a plan it is the end of the drawn path in any case."""
    return estimate.claims_place or not plan.is_drawn


def sample_of(particles: ParticleSnapshot) -> ParticleSample:
    """The tracker's published particles as they are drawn: weights relative to the greatest, positions in single precision."""
    weight = np.exp(particles.log_weight)
    shown = (255.0 * weight / max(float(weight.max()), 1e-300)).astype(np.uint8)
    x_m, y_m = particles.x_m.astype(np.float32), particles.y_m.astype(np.float32)
    return ParticleSample(x_m, y_m, shown, np.minimum(particles.level, 255).astype(np.uint8))


def status_text(
    estimate: Estimate | None, *, needs_start: bool = False, accepts_taps: bool = True, no_plan: bool = False
) -> str:
    """Status and accuracy in words.

    `no_plan`: no floors; the page shows the height against the start. `needs_start`: the tracker waits for a check-in that gives the start.
    `accepts_taps`: the page takes check-ins (not so in a replay).
    """
    tap = " or tap where you are" if accepts_taps else ""
    if estimate is None:
        return "tap where you stand to start" if needs_start else "waiting for the foot to stand still"
    if estimate.plan_fits < PROBABLE:
        return "this plan does not fit: is it another building or floor, or mirrored?"
    if floor := other_floor(estimate):
        return f"{estimate.status.value}: {floor}"
    if estimate.status != TrackStatus.TRACKING and estimate.hypotheses and not estimate.is_one_place:
        return f"{estimate.status.value}: {fitting(estimate.hypotheses)}; walk on, turn into a room{tap}"
    if estimate.status == TrackStatus.LOST and not no_plan:
        return "lost: walk along a wall or tap where you are" if accepts_taps else "lost"
    where = ", outside the building" if estimate.outside > PROBABLE else _height_words(estimate.z_m) if no_plan else ""
    return f"{estimate.status.value}{where}, {format_metres(estimate.ellipse95.major_m)}{elsewhere(estimate)}"


def _height_words(z_m: float) -> str:
    """A height against the start, where it is about a storey."""
    return "" if abs(z_m) < SHOWN_HEIGHT_M else f", {abs(z_m):.0f} m {'above' if z_m > 0.0 else 'below'} the start"


def format_metres(distance_m: float) -> str:
    """A length as text, rounded as people need it: 0.2 m, 3 m, 40 m."""
    return f"{distance_m:.1f} m" if distance_m < 0.95 else f"{distance_m:.0f} m"


@dataclass(frozen=True, slots=True)
class TruePosition:
    """Map metres, and the index of a level."""

    x_m: float
    y_m: float
    level: int


@dataclass(frozen=True, slots=True)
class TruePath:
    """`rows` (n, 4): t_s, x, y, index of the level."""

    rows: Floats

    @classmethod
    def of(cls, truth: ScoredPath | None, plan: Plan) -> TruePath | None:
        """Of a true path that was loaded with the plan; None without one, and where it is not known on which level it is."""
        if truth is None or truth.level is None or not np.isin(truth.level, np.arange(len(plan.levels))).all():
            return None
        return cls(np.column_stack([truth.t_s, truth.xy_m, truth.level]))

    def at(self, t_s: float) -> TruePosition:
        """The position at a time, linear between the rows."""
        t, x, y, level = self.rows.T
        row = max(int(np.searchsorted(t, t_s, side="right")) - 1, 0)
        return TruePosition(float(np.interp(t_s, t, x)), float(np.interp(t_s, t, y)), int(level[row]))
