# SPDX-License-Identifier: MIT
"""A simulated walk as the filter gets it: the bytes of a simulated board and MTx through the tracker's front end, once for all conditions.

In: a `Site` and a seed. Out: `SimulatedWalk`: measured segments, and the truth. Owns nothing. Foot, rangers and barometer have their simulated
errors; the echoes come from the building as it stands.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from echostep.arrays import Floats
from echostep.localization import Estimate
from echostep.path import MeasuredSegment
from echostep.plan import Plan, Pose
from echostep.ports.chunks import MTX, Chunk
from echostep.settings import Settings
from echostep.tracker import Tracker
from echostep_app.session.chunk_streams import portions_of
from echostep_simulation.devices.board import PythonBoard
from echostep_simulation.devices.board_sensors import WornGyro
from echostep_simulation.devices.mtx import MtxModel
from echostep_simulation.people.walker import Person
from echostep_simulation.scenario import START_NS, Scenario
from echostep_studies.bench.sites import Site
from echostep_studies.frame.truth import at_times

CORNER_M = 0.3  # corners are cut by so much, so that the way stays clear of door jambs
PORTION = 1000  # chunks that a tracker or a front end gets at once
T, X, Y, HEADING, Z = range(5)  # columns of the truth


@dataclass(frozen=True, slots=True)
class SimulatedWalk:
    """`segments` as the filter gets them. `truth` (n, 5): t_s, x, y, heading, height of the floor. `built`: what stands there."""

    built: Plan
    segments: tuple[MeasuredSegment, ...]
    truth: Floats

    def pose_at(self, t_s: float) -> Pose:
        """True pose of the trunk at a time, on the nearest level."""
        x, y, z = (float(np.interp(t_s, self.truth[:, T], self.truth[:, k])) for k in (X, Y, Z))
        heading = float(np.interp(t_s, self.truth[:, T], np.unwrap(self.truth[:, HEADING])))
        heights = [abs(level.height_m - z) for level in self.built.levels]
        return Pose(x, y, heading, heights.index(min(heights)))

    def places_at(self, t_s: Floats) -> Floats:
        """True places (n, 2) at times (n,)."""
        return at_times(t_s, self.truth[:, T], self.truth[:, [X, Y]])

    def heights_at(self, t_s: Floats) -> Floats:
        """True heights of the floor (n,) at times (n,)."""
        return np.interp(t_s, self.truth[:, T], self.truth[:, Z])

    def walked_m(self, t_s: Floats) -> Floats:
        """Length of the true way up to times (n,), seen from above."""
        return np.interp(t_s, self.truth[:, T], way_m(self.truth))

    def time_at(self, walked_m: float) -> float:
        """When this length of the way was walked."""
        way = way_m(self.truth)
        return float(self.truth[min(int(np.searchsorted(way, walked_m)), len(way) - 1), T])


def way_m(truth: Floats) -> Floats:
    """Length (n,) of the true way up to each row of a truth (n, 5), seen from above."""
    return np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(truth[:, X]), np.diff(truth[:, Y])))])


def simulate(site: Site, seed: int, model: MtxModel | None = None, worn: WornGyro | None = None) -> SimulatedWalk:
    """The walk of a site, with another MTx and belt gyro than usual."""
    return walk_of(site.built, *_chunks(site, seed, model, worn))


def simulate_by_legs(site: Site, seed: int) -> SimulatedWalk:
    """The same walk without an MTx, by the gyros of a leg."""
    chunks, truth = _chunks(site, seed)
    return walk_of(site.built, [c for c in chunks if c.port != MTX], truth)


def simulate_with_gap(site: Site, seed: int, from_m: float, gap_s: float) -> tuple[SimulatedWalk, float]:
    """The walk without the bytes that arrive for `gap_s` after `from_m` of the way, as when a laptop sleeps; and when the gap is over."""
    chunks, truth = _chunks(site, seed)
    begin_s = walk_of(site.built, (), truth).time_at(from_m)
    gap_ns = [START_NS + int(1e9 * t_s) for t_s in (begin_s, begin_s + gap_s)]
    remaining = [c for c in chunks if not gap_ns[0] <= c.t_arrival_ns < gap_ns[1]]
    return walk_of(site.built, remaining, truth), begin_s + gap_s


def _chunks(
    site: Site, seed: int, model: MtxModel | None = None, worn: WornGyro | None = None
) -> tuple[list[Chunk], Floats]:
    person = Person(corner_m=CORNER_M)
    scenario = Scenario(site.built, site.waypoints, seed, PythonBoard(seed), person, model, worn=worn)
    return list(scenario.chunks()), scenario.truth


def walk_of(built: Plan, chunks: Sequence[Chunk], truth: Floats, settings: Settings | None = None) -> SimulatedWalk:
    """The walk that these bytes are."""
    front_end = Tracker(built, None, settings, waits=True).front_end
    pieces = [piece for portion in portions_of(chunks, PORTION) for piece in front_end.process(portion)]
    return SimulatedWalk(built, tuple(p for p in pieces if isinstance(p, MeasuredSegment)), truth)


def tracked(tracker: Tracker, chunks: Sequence[Chunk]) -> list[Estimate]:
    """The estimates of a tracker that takes these bytes."""
    return [estimate for portion in portions_of(chunks, PORTION) for estimate in tracker.take(portion)]
