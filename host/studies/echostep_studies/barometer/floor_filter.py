# SPDX-License-Identifier: MIT
"""Which floor: a hidden state over the building's storeys, with stairs and lifts between them.

In: `Pressures` and the storeys' heights. Out: probabilities of each floor, the height in the building's frame, from a whole record: an ambiguous
start is resolved when the walk shows which storeys fit. Owns nothing.

A floor is the index into `heights_m`. On stairs and in a lift the nearest storey counts: the floor changes at the middle between two levels.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.errors import EchostepError
from echostep_studies.barometer import vertical_model as vertical
from echostep_studies.barometer.altitude import Pressures, observations
from echostep_studies.barometer.vertical_kernels import smooth

TIED = 0.9  # of the best floor's probability: then the lowest of them is named
CLOSEST_M, HIGHEST_M, MOST_STOREYS = 1.5, 2000.0, 64


@dataclass(frozen=True, slots=True)
class Floors:
    """At samples (n,): `floor`, the most probable index into `heights_m`; `probability` (n, k) of each; `height_m` in their frame.

    `up`, `down`: probability of being on the way, on stairs or in a lift.
    """

    t_s: Floats
    heights_m: Floats
    floor: Ints
    probability: Floats
    height_m: Floats
    up: Floats
    down: Floats


def smooth_floors(samples: Pressures, heights_m: Floats, noise_pa: float, prior: Floats | None = None) -> Floors:
    """Floors at all samples of a record, each by the whole record.

    `heights_m` (k,) ascending; `noise_pa`: standard deviation of a sample; `prior` (k,) of the floor at the start, uniform by default. Raises
    EchostepError for impossible heights.
    """
    heights_m = checked_heights(heights_m)
    seen = observations(samples, noise_pa, float(heights_m[0]), float(heights_m[-1]))
    states, weight = smooth(seen, heights_m, np.ones(len(heights_m)) if prior is None else prior, free=False)
    return _floors(samples.t_s, heights_m, states, weight)


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
                f"heights: storey {k + 1} ({heights[k + 1]:g} m) is not {CLOSEST_M} m or more above storey {k} ({heights[k]:g} m): "
                "give them ascending, in metres"
            )
    return heights


def _floors(t_s: Floats, heights_m: Floats, states: Floats, weight: Floats) -> Floors:
    """Floors by weights (n, 15 k): the hypothesis' level when on one, the nearest levels by its height otherwise."""
    n, count = len(states), len(heights_m)
    middles = 0.5 * (heights_m[1:] + heights_m[:-1])
    probability = np.zeros((n, count))
    height = states[:, :, vertical.RESULT_HEIGHT]
    sd = np.sqrt(np.maximum(states[:, :, vertical.RESULT_VARIANCE], 1e-6))
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
    floor = np.argmax(probability >= TIED * probability.max(axis=1, keepdims=True), axis=1)
    ways = np.arange(weight.shape[1]) % vertical.WAYS
    up = weight[:, (ways == vertical.STAIRS_UP) | (ways == vertical.LIFT_UP)].sum(axis=1)
    down = weight[:, (ways == vertical.STAIRS_DOWN) | (ways == vertical.LIFT_DOWN)].sum(axis=1)
    return Floors(
        t_s, heights_m, floor.astype(np.int64), probability, _height(heights_m, floor, height, weight), up, down
    )


def _height(heights_m: Floats, floor: Ints, height: Floats, weight: Floats) -> Floats:
    """Mean height of the hypotheses whose nearest level is the reported floor."""
    nearest = np.abs(height[:, :, None] - heights_m).argmin(axis=2) == floor[:, None]
    w = weight * nearest
    total = w.sum(axis=1)
    return np.asarray(np.where(total > 0.0, (w * height).sum(axis=1) / np.maximum(total, 1e-300), heights_m[floor]))


def _normal_cdf(x: Floats) -> Floats:
    """Cumulative standard normal distribution, error below 1e-4, by its logistic approximation [Bowling et al. 2009]."""
    return np.asarray(1.0 / (1.0 + np.exp(-np.clip(1.5976 * x + 0.07056 * x**3, -700.0, 700.0))))
