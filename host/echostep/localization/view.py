# SPDX-License-Identifier: MIT
"""What a ranger heard last: a wall, or nothing. It foretells the next ping without a plan.

In: the places and ranges of one ranger's pings in the walk frame. Out: the density of the next range if the view goes on. Owns the last wall.
"""

from __future__ import annotations

import math

from echostep.localization.echo_likelihood import EchoSettings
from echostep.localization.last_wall import LastWall


class View:
    """`density` before `update` for each ping, after `move`."""

    def __init__(self, echo: EchoSettings) -> None:
        self._echo = echo
        self._wall: LastWall | None = None  # None: nothing was heard
        self._x_m, self._y_m = math.nan, math.nan

    def move(self, x_m: float, y_m: float) -> float:
        """Go on to the place of the next ping; returns the length of the way (m), infinite to the first one."""
        dx_m, dy_m = x_m - self._x_m, y_m - self._y_m
        self._x_m, self._y_m = x_m, y_m
        if math.isnan(dx_m):
            return math.inf
        if self._wall is not None:
            self._wall.move(dx_m, dy_m)
        return math.hypot(dx_m, dy_m)

    def density(self, range_m: float, axis_rad: float) -> float:
        """Density (1/m) of a range if the view goes on; range 0: the probability of no echo."""
        if range_m <= 0.0:
            return 1.0 if self._wall is None else 0.0
        return 0.0 if self._wall is None else self._wall.density(range_m, axis_rad)

    def update(self, range_m: float, axis_rad: float, power: float, goes_on: bool) -> None:
        """Take a ping in; `goes_on`: whether the view goes on, by the densities."""
        if range_m <= 0.0:
            if not goes_on:  # otherwise it is likelier that an echo was missed
                self._wall = None
        elif goes_on and self._wall is not None:
            self._wall.update(range_m, axis_rad, power)
        else:
            self._wall = LastWall(range_m, axis_rad, self._echo.sd_m, self._echo.slant_m)
