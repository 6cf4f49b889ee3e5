# SPDX-License-Identifier: MIT
"""Faults of a ranger: it looks elsewhere, is covered, or hears the arm or the floor.

In: `PosedPings` of a walk, the walls, the usual settings. Out: one sentence for each fault. Owns the limits, which are assumed.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from echostep.arrays import Floats
from echostep.echoes.likelihood import EchoSettings
from echostep.walls.echo_sources import Walls
from echostep_app.commissioning.rangers.fit import BLOCK, score
from echostep_app.commissioning.rangers.known_pings import KnownPings, known_pings
from echostep_app.commissioning.rangers.poses import PosedPings

LEFT, RIGHT = 0, 1
SIDES = ("left", "right")
AHEAD_DEG = (-60, -45, -30, 30, 45, 60)  # axes that are tried beside abeam; smaller errors are within the beam
OPPOSITE_DEG = 180
POSE_SD_M = 0.2  # of places that the tracker found with a faulty ranger, assumed
# Another axis explains the pings better by this many standard deviations, and by this many nats a ping
SURE_SD, LEAST_GAIN = 4.0, 0.1
COVER_M, COVERED = 0.3, 0.6  # cloth or a hand: most echoes come from nearer
HEARD = 0.05  # share of echoes of a ranger that hears nothing
ARM_M, ARM = 0.75, 0.15  # an arm's length; share of pings that something there answers, though no wall is that near
# The floor from a hip, aslant; share of pings with one and the same range that no wall explains
FLOOR_M, FLOOR = (0.75, 2.5), 0.2
SAME_M = 0.1
SWAPPED = "The rangers are swapped: each hears the walls of the other side. Swap their plugs."
WALL_SD = 4.0  # a range within this many of its deviations of a source is that source's


def faults_of(pings: PosedPings, known: list[KnownPings], walls: Walls, base: EchoSettings) -> list[str]:
    """Faults of both rangers by all pings, and by each one's pings with the sources before them.

    The axis of a ranger that hears something is checked first: a wrong axis looks like the other faults.
    """
    faults = [fault for k, own in enumerate(known) if (fault := _deaf(own, k))]
    if faults:
        return faults
    wide = replace(base, sd_m=POSE_SD_M)
    best = [_better_axis(pings, which, walls, wide) for which in (LEFT, RIGHT)]
    if OPPOSITE_DEG in best:
        return [SWAPPED]
    turned = [
        f"The {SIDES[k]} ranger looks about {abs(deg)} degrees {'ahead of' if deg > 0 else 'behind'} abeam: turn it, "
        f"or state it where both do: [ranger] ahead_deg = {deg}"
        for k, deg in enumerate(best)
        if deg
    ]
    return turned or [fault for k, own in enumerate(known) for fault in _echo_faults(own, k, base)]


def explained(pings: PosedPings, walls: Walls, base: EchoSettings) -> float:
    """Mean log-density of the pings by the plan, at the places where they were sent; -inf without one."""
    wide = replace(base, sd_m=POSE_SD_M)
    log_p = [_log_p(pings, pings.ranger == which, walls, 0.0, wide) for which in (LEFT, RIGHT)]
    return float(np.concatenate(log_p).mean()) if len(pings.ranger) else -math.inf


def _better_axis(pings: PosedPings, which: int, walls: Walls, settings: EchoSettings) -> int:
    """Degrees ahead of abeam at which a ranger surely explains its pings better; 0 if none."""
    own = pings.ranger == which
    if not own.any():
        return 0
    sign = -1.0 if which == LEFT else 1.0
    usual, gains = _log_p(pings, own, walls, 0.0, settings), {}
    for deg in (*AHEAD_DEG, OPPOSITE_DEG):
        gain = _log_p(pings, own, walls, sign * math.radians(deg), settings) - usual
        blocks = np.add.reduceat(gain, np.arange(0, len(gain), BLOCK))
        sd = float(blocks.std()) * math.sqrt(len(blocks))
        if gain.sum() > SURE_SD * sd and gain.mean() > LEAST_GAIN:
            gains[deg] = float(gain.sum())
    return max(gains, key=lambda deg: gains[deg], default=0)


def _log_p(pings: PosedPings, own: np.ndarray, walls: Walls, turn_rad: float, settings: EchoSettings) -> Floats:
    known = known_pings(walls, pings.x_m[own], pings.y_m[own], pings.axis_rad[own] + turn_rad, pings.range_m[own])
    return score(known, {}, settings)


def _deaf(known: KnownPings, which: int) -> str:
    """Why a ranger hears no walls at all; empty if it does."""
    name = f"The {SIDES[which]} ranger"
    if not len(known.range_m):
        return f"{name} sent no ping: run echostep doctor."
    heard, first = known.range_m > 0.0, np.where(known.listed > 0, known.distance_m[:, 0], np.inf)
    if (heard & (known.range_m < COVER_M) & (first > 2.0 * COVER_M)).mean() > COVERED:
        return f"{name} is covered: most of its echoes come from nearer than {COVER_M:g} m. Free its front of cloth and straps."
    if heard.mean() < HEARD:
        return f"{name} hears nothing: is it covered, or its plug loose? Run echostep doctor."
    return ""


def _echo_faults(known: KnownPings, which: int, base: EchoSettings) -> list[str]:
    """Echoes that one ranger hears instead of walls, from its pings at known places."""
    heard, first = known.range_m > 0.0, np.where(known.listed > 0, known.distance_m[:, 0], np.inf)
    name = f"The {SIDES[which]} ranger"
    faults = []
    sd = WALL_SD * math.hypot(base.sd_m, 0.5 * POSE_SD_M)
    near = heard & (known.range_m < ARM_M) & (known.range_m < first - sd)
    if near.mean() > ARM:
        faults.append(
            f"{name} hears the arm: {100 * near.mean():.0f} % of its pings are answered nearer than {ARM_M:g} m, where no wall is. "
            "Wear it before or behind the swing of the arm."
        )
    height_m, share = _floor(known, heard, sd)
    if share > FLOOR:
        faults.append(
            f"{name} points down: {100 * share:.0f} % of its pings have the range {height_m:.1f} m, which no wall explains. Level it."
        )
    return faults


def _floor(known: KnownPings, heard: np.ndarray, sd_m: float) -> tuple[float, float]:
    """The range that most unexplained echoes have, and the share of all pings that have it."""
    listed = np.arange(known.distance_m.shape[1]) < known.listed[:, None]
    explained = (listed & (np.abs(known.distance_m - known.range_m[:, None]) < sd_m)).any(1)
    ranges_m = known.range_m[heard & ~explained]
    ranges_m = np.sort(ranges_m[(ranges_m > FLOOR_M[0]) & (ranges_m < FLOOR_M[1])])
    if not len(ranges_m):
        return 0.0, 0.0
    alike = np.searchsorted(ranges_m, ranges_m + 2.0 * SAME_M) - np.arange(len(ranges_m))
    first = int(np.argmax(alike))
    return float(np.median(ranges_m[first : first + alike[first]])), float(alike[first]) / len(known.range_m)
