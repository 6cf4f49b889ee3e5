# SPDX-License-Identifier: MIT
"""Bearing: a heading in words, as people read a compass: "E 090°".

In: a plan, a heading on it. Out: words; the direction of north on the plan, to which the pages turn needle and view. Owns the limit of a known
heading. Page, terminal and the commander's lists take their words from here; files and reports for machines keep radians and degrees
counter-clockwise from x.
"""

from __future__ import annotations

import math

from echostep.plan import Plan

KNOWN_HEADING_RAD = 1.0  # standard deviation above which a heading is not known, assumed
LETTERS = ("N", "NE", "E", "SE", "S", "SW", "W", "NW")
NOT_KNOWN = "not known"


def north_rad(plan: Plan) -> float:
    """The heading of north, in rad counter-clockwise from the map's x axis: true north on a plan with a georeference, else the map's y axis."""
    return 0.5 * math.pi - (plan.georeference.rotation_rad if plan.georeference else 0.0)


def heading_words(plan: Plan, heading_rad: float | None, sd_rad: float | None = None) -> str:
    """A heading (rad, counter-clockwise from the map's x axis) as degrees clockwise from north, with its standard deviation where that is given.

    North that is the map's y axis is called "plan north". Without a plan, y is the direction in which the walk began: no letter.
    """
    if heading_rad is None or (sd_rad is not None and sd_rad > KNOWN_HEADING_RAD):
        return NOT_KNOWN
    bearing_deg = round(math.degrees(north_rad(plan) - heading_rad)) % 360
    letter = f"{LETTERS[round(bearing_deg / 45.0) % 8]} " if plan.is_drawn else ""
    spread = "" if sd_rad is None else f" ±{math.degrees(sd_rad):.0f}°"
    north = ", plan north" if plan.is_drawn and plan.georeference is None else ""
    return f"{letter}{bearing_deg:03d}°{spread}{north}"
