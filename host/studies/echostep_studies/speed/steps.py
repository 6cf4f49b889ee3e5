# SPDX-License-Identifier: MIT
"""Speed of the step of [Girard 2011], against updates of filters without a map, and against itself with plain rays.

In: a `Scale`. Out: `Row`s. Owns nothing.
"""

from __future__ import annotations

from collections.abc import Iterator
from unittest import mock

import numpy as np

from echostep_studies.papers import girard2011
from echostep_studies.speed.among_walls import cloud, offices
from echostep_studies.speed.comparison import Row, Scale, Work, compared
from echostep_studies.speed.peers import MAPLESS, MISSING, plain_rays


def stepping(scale: Scale) -> Iterator[Row]:
    """The whole step of [Girard 2011] with its map, against other filters' updates without one, and against itself with rays."""
    walls = offices(scale.office)
    x, y, _ = cloud(walls, 1)

    def stepper(candidates: int) -> Work:
        settings = girard2011.GirardSettings(nu=max(candidates // 20, 1))
        filter_ = girard2011.Girard(
            settings, (float(x[0]), 12.5 * (y[0] // 12.5) + 6.25), walls, np.random.default_rng(1)
        )
        ahead = [1.0]

        def step() -> object:
            ahead[0] = -ahead[0]
            return filter_.step(1.25 * ahead[0], 0.0, 0.0, (1.2, 1.3))

        for _ in range(6):
            step()
        return step

    for name, update in MAPLESS.items():
        if name not in MISSING:
            yield compared(
                f"step of {scale.candidates:,} candidates; update of {name}, no map",
                stepper(scale.candidates),
                update(scale.candidates),
                scale.rounds,
                2.0,
            )
    step = stepper(3000)

    def with_rays() -> object:
        with mock.patch("echostep_studies.papers.girard2011.lambda_ray_ranges", plain_rays):
            return step()

    yield compared("step at nu = 150; the same by our own plain rays", step, with_rays, scale.rounds, 10.0)
