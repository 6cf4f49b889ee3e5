# SPDX-License-Identifier: MIT
"""The result of `echostep calibrate rangers`: faults, fits, and the settings that follow.

In: the placed pings of one walk, the filter's walls, the usual settings. Out: `RangerReport`. Owns nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from echostep.board.calibration import RangerSettings
from echostep.echoes.likelihood import EchoSettings
from echostep.walls.echo_sources import Walls
from echostep_app.commissioning.fitting import Values
from echostep_app.commissioning.rangers.faults import SIDES, faults_of
from echostep_app.commissioning.rangers.fit import BIAS, LEAST_PINGS, MISSED, OWN, RangerFit, fit_ranger
from echostep_app.commissioning.rangers.known_pings import KnownPings, known_pings
from echostep_app.commissioning.rangers.poses import PosedPings

WRITTEN = tuple(name for name in OWN if name != BIAS)  # of `[echo]`, which both rangers share
WORDS = {
    BIAS: "measures too much by", "maximum_m": "hears a wall ahead to", "rim_db": "beam at 27.5 degrees is down by", "sd_m": "error",
    MISSED: "misses", "stray": "too long instead of silent",
}  # fmt: skip
UNITS = {BIAS: "m", "maximum_m": "m", "rim_db": "dB", "sd_m": "m", MISSED: "", "stray": ""}
BELIEVED = 0.5  # share of the pings sent while `tracking`, below which their places are not known
SHORTEST = 3  # this many shorter echoes, not one by chance, lower the least range; assumed
SURE_SD = 2.0  # of the gain on held-out pings, by which settings must be better to be written


@dataclass(frozen=True, slots=True)
class RangerReport:
    """`faults` and `lines` for the wearer, and the settings by section; none if a fault remains or no fit is better than the usual settings."""

    faults: list[str]
    lines: list[str]
    values: dict[str, Values]


def report(placed: PosedPings, walls: Walls, base: EchoSettings, recorded: RangerSettings) -> RangerReport:
    """Name faults, fit each ranger without one; `recorded`: settings of the walk, whose biases have been taken off the ranges."""
    if placed.believed < BELIEVED:
        return RangerReport([], [_unbelieved(placed)], {})
    pings = [
        known_pings(
            walls, *(column[placed.ranger == k] for column in (placed.x_m, placed.y_m, placed.axis_rad, placed.range_m))
        )
        for k in range(len(SIDES))
    ]
    faults = faults_of(placed, pings, walls, base)
    if faults:
        return RangerReport(faults, [], {})
    few = [f"The {SIDES[k]} ranger sent {len(p.range_m)} pings where the place is known: {LEAST_PINGS} are needed: walk for a minute."
           for k, p in enumerate(pings) if len(p.range_m) < LEAST_PINGS]  # fmt: skip
    return RangerReport([], few, {}) if few else _fitted(pings, base, recorded, _shortest(placed, base))


def _unbelieved(placed: PosedPings) -> str:
    return (
        f"The place is known for {100 * placed.believed:.0f} % of the pings only: begin at a marked start, "
        "on a plan that is the building's; echostep info tells what was received."
    )


def _shortest(placed: PosedPings, base: EchoSettings) -> float:
    """The least range: the usual one, or a shorter one from shorter echoes."""
    ranges_m = np.sort(placed.range_m[placed.range_m > 0.0])
    return min(base.minimum_m, float(ranges_m[SHORTEST - 1])) if len(ranges_m) >= SHORTEST else base.minimum_m


def _fitted(pings: list[KnownPings], usual: EchoSettings, recorded: RangerSettings, minimum_m: float) -> RangerReport:
    base = replace(usual, minimum_m=minimum_m)
    fits = [fit_ranger(own, base) for own in pings]
    lines = [line for side, fit in zip(SIDES, fits, strict=True) for line in _lines(side, fit)]
    gain = sum((fit.score - fit.score_before) * fit.pings for fit in fits)
    gain_sd = math.hypot(*(fit.gain_sd * fit.pings for fit in fits))
    if gain < SURE_SD * gain_sd:
        return RangerReport([], [*lines, "The usual settings explain other pings as well: nothing is written."], {})
    echo: Values = {name: round(_joint(name, fits), 4) for name in WRITTEN}
    if minimum_m < usual.minimum_m:
        lines.append(f"both: hear from {minimum_m:.2f} m on, or nearer")
        echo["minimum_m"] = round(minimum_m, 3)
    names = [f"{side}_{BIAS}" for side in SIDES]
    ranger: Values = {
        name: round(getattr(recorded, name) + fit.values[BIAS], 4) for name, fit in zip(names, fits, strict=True)
    }
    return RangerReport([], lines, {"echo": echo, "ranger": ranger})


def _lines(side: str, fit: RangerFit) -> list[str]:
    parts = [
        f"{words} {fit.values[name]:.3g} +- {fit.sd[name]:.1g} {UNITS[name]}".rstrip() for name, words in WORDS.items()
    ]
    return [
        f"{side}: {', '.join(parts)}",
        f"{side}: log-score of {fit.pings} held-out pings {fit.score:.3f} a ping, {fit.score_before:.3f} by the usual settings "
        f"(difference known to {fit.gain_sd:.3f})",
    ]  # fmt: skip


def _joint(name: str, fits: list[RangerFit]) -> float:
    """The value of both rangers, which share one model: each counts by its variance."""
    weights = [1.0 / max(fit.sd[name], 1e-9) ** 2 for fit in fits]
    return sum(w * fit.values[name] for w, fit in zip(weights, fits, strict=True)) / sum(weights)
