"""Which floor: a hidden state over the building's storeys, with stairs and lifts between them.

In: `Pressures` and the storeys' heights. Out: probabilities of each floor, the height in the building's frame; live, sample by sample, or from a whole record, where
what comes later helps: an ambiguous start is resolved when the walk shows which storeys fit. Owns the filter's state (`vertical.py`).

A floor is the index into `heights_m`. On stairs and in a lift the nearest storey counts: the floor changes when he passes the middle between two.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from echostep import vertical
from echostep.altitude import Altitude, BarometerSettings, Column, Heights, Pressures
from echostep.errors import EchostepError

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

BLOCK = 256  # samples whose transitions are in memory at once
TIED = 0.9  # of the best floor's probability: then the lowest of them is named
BETWEEN_P = 0.5
CLOSEST_M, HIGHEST_M, MOST_STOREYS = 1.5, 2000.0, 64
SHORTEST_STAY_S, SAME_STOREY_M, LEVEL_P = 8.0, 1.2, 0.2


@dataclass(frozen=True, slots=True)
class Floors:
    """At samples (n,): `floor`, the most probable index into `heights_m`; `probability` (n, k) of each; `height_m` in their frame; `up`, `down`: probability of being on the way."""

    t_s: Floats
    heights_m: Floats
    floor: Ints
    probability: Floats
    height_m: Floats
    up: Floats
    down: Floats


class FloorFilter:
    """Floors of one barometer, live; `take` in any portions gives the same floors."""

    def __init__(
        self, heights_m: Floats, settings: BarometerSettings | None = None, prior: Floats | None = None
    ) -> None:
        """`heights_m` (k,) ascending; `prior` (k,) of the floor at the start, uniform by default. Raises EchostepError for impossible heights."""
        self.heights_m = checked_heights(heights_m)
        self._prior = np.ones(len(self.heights_m)) if prior is None else np.asarray(prior, float)
        self._column = Column(settings or BarometerSettings(), float(self.heights_m[0]), float(self.heights_m[-1]))
        self._state: tuple[Floats, Floats, Floats] | None = None

    def take(self, samples: Pressures) -> Floors:
        """Floors at the samples that could be used, each by what was known then."""
        seen, used = self._column.rows(samples)
        found, _ = self._follow(seen, joint=False)
        return _floors(samples.t_s[used], self.heights_m, found, found[:, :, 0], seen[:, vertical.CLAIMED])

    def look_back(self, samples: Pressures) -> Floors:
        """Floors at the samples of a whole record, each by all of it."""
        seen, used = self._column.rows(samples)
        found = np.zeros((len(seen), len(self.heights_m) * vertical.MODES, 5))
        states = []
        for block in _blocks(len(seen)):
            states.append(self._copy())
            found[block], _ = self._follow(seen[block], joint=False)
        smooth = np.zeros(found.shape[:2])
        if len(seen):
            smooth[-1] = found[-1, :, 0]
        for block, state in zip(reversed(list(_blocks(len(seen)))), reversed(states), strict=True):
            self._state = state
            _, joint = self._follow(seen[block], joint=True)
            before = vertical.backward(joint, smooth[block.stop - 1])
            smooth[block.start : block.stop - 1] = before[1:]
            if block.start:
                smooth[block.start - 1] = before[0]
        return _floors(samples.t_s[used], self.heights_m, found, smooth, seen[:, vertical.CLAIMED])

    def _copy(self) -> tuple[Floats, Floats, Floats] | None:
        return None if self._state is None else (self._state[0].copy(), self._state[1].copy(), self._state[2].copy())

    def _follow(self, seen: Floats, *, joint: bool) -> tuple[Floats, Floats]:
        size = len(self.heights_m) * vertical.MODES
        found, pairs = np.zeros((len(seen), size, 5)), np.zeros((len(seen) if joint else 0, size, size))
        if self._state is None and len(seen):
            first = seen[0]
            self._state = vertical.start(self.heights_m, self._prior, first[vertical.CLAIMED], first[vertical.NOISE])
        if self._state is not None:
            vertical.follow(self._state, self.heights_m, False, seen, found, pairs)
        return found, pairs


def _blocks(n: int) -> Iterator[slice]:
    for first in range(0, n, BLOCK):
        yield slice(first, min(first + BLOCK, n))


def checked_heights(heights_m: Floats) -> Floats:
    """The heights of the storeys; raises EchostepError when they cannot be a building's."""
    heights = np.asarray(heights_m, dtype=float)
    if heights.ndim != 1 or not 1 <= len(heights) <= MOST_STOREYS:
        raise EchostepError(f"heights: {heights.size} storeys, expected 1 to {MOST_STOREYS}")
    if not np.isfinite(heights).all() or np.abs(heights).max() > HIGHEST_M:
        raise EchostepError(f"heights: metres between {-HIGHEST_M:.0f} and {HIGHEST_M:.0f} are expected")
    for k, gap in enumerate(np.diff(heights)):
        if gap < CLOSEST_M:
            raise EchostepError(
                f"heights: storey {k + 1} ({heights[k + 1]:g} m) is not {CLOSEST_M} m or more above storey {k} ({heights[k]:g} m): give them ascending, in metres"
            )
    return heights


def _floors(t_s: Floats, heights_m: Floats, found: Floats, weight: Floats, claimed: Floats) -> Floors:
    """Floors by weights (n, 10 k): the storey of those who are on one, the nearest one of those between."""
    n, count = len(found), len(heights_m)
    middles = 0.5 * (heights_m[1:] + heights_m[:-1])
    probability = np.zeros((n, count))
    height = found[:, :, 1]
    sd = np.sqrt(np.maximum(found[:, :, 4], 1e-6))
    for k in range(count):
        for mode in range(vertical.MODES):
            s = k * vertical.MODES + mode
            w = weight[:, s]
            if mode % vertical.WAYS == vertical.ON:
                probability[:, k] += w
            elif w.max(initial=0.0) > 0.0:
                above = _normal_cdf((height[:, s, None] - middles) / sd[:, s, None])
                edges = np.hstack([np.ones((n, 1)), above, np.zeros((n, 1))])
                probability += w[:, None] * (edges[:, :-1] - edges[:, 1:])
    probability /= np.maximum(probability.sum(axis=1, keepdims=True), 1e-300)
    best = probability.max(axis=1, keepdims=True, initial=0.0)
    floor = np.argmax(probability >= TIED * best, axis=1) if n else np.zeros(0, int)
    ways = np.arange(weight.shape[1]) % vertical.WAYS
    up = weight[:, (ways == vertical.STAIRS_UP) | (ways == vertical.LIFT_UP)].sum(axis=1)
    down = weight[:, (ways == vertical.STAIRS_DOWN) | (ways == vertical.LIFT_DOWN)].sum(axis=1)
    return Floors(
        t_s, heights_m, floor.astype(np.int64), probability, _height(heights_m, floor, height, weight), up, down
    )


def _height(heights_m: Floats, floor: Ints, height: Floats, weight: Floats) -> Floats:
    """Mean height of the hypotheses that have him nearest to the named floor."""
    nearest = np.abs(height[:, :, None] - heights_m).argmin(axis=2) == floor[:, None]
    w = weight * nearest
    total = w.sum(axis=1)
    return np.asarray(np.where(total > 0.0, (w * height).sum(axis=1) / np.maximum(total, 1e-300), heights_m[floor]))


def _normal_cdf(x: Floats) -> Floats:
    """Of the standard normal distribution, to 1e-4 and better, by its logistic approximation [Bowling et al. 2009]."""
    return np.asarray(1.0 / (1.0 + np.exp(-np.clip(1.5976 * x + 0.07056 * x**3, -700.0, 700.0))))
