# SPDX-License-Identifier: MIT
"""Names, units and sources of the metrics.

In: a `Scorecard`. Out: rows of text for tables. Owns the order of the metrics.

The clauses are from the standard's public table of contents [NIST, ISO/IEC 18305:2016 table of contents]; its text was not available, so each row
states what is computed.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

from echostep_app.scorecard.card import FLOOR_PENALTY_M, GAP_S, Scorecard

ISO = "ISO/IEC 18305:2016"
EVAAL = "Potorti et al. 2017, Sensors 17(10) 2327 (EvAAL, IPIN)"
STANFORD = "Tossaint et al. 2007 (Stanford diagram)"


class Metric(NamedTuple):
    """A row of the scorecard: `value` of a card in `unit`, or None; `meaning` in words."""

    name: str
    unit: str
    source: str
    meaning: str
    value: Callable[[Scorecard], float | None]


METRICS: tuple[Metric, ...] = (
    Metric("horizontal error, mean", "m", f"{ISO}, 8.4", "mean distance from the truth", lambda c: c.horizontal.mean_m),
    Metric(
        "horizontal error, sd", "m", f"{ISO}, 8.6", "standard deviation of the distances", lambda c: c.horizontal.sd_m
    ),
    Metric("horizontal error, rms", "m", f"{ISO}, 8.7", "root of the mean square", lambda c: c.horizontal.rms_m),
    Metric("bias", "m", f"{ISO}, 8.8", "length of the mean error vector", lambda c: c.bias_m),
    Metric("CE50 (CEP)", "m", f"{ISO}, 8.9", "half of the horizontal errors are below it", lambda c: c.ce50_m),
    Metric("CE95", "m", f"{ISO}, 8.9", "95 % of the horizontal errors are below it", lambda c: c.ce95_m),
    Metric("horizontal error, max", "m", "", "greatest distance from the truth", lambda c: c.horizontal.max_m),
    Metric("horizontal error, end", "m", "", "distance at the last point", lambda c: c.horizontal.ending_m),
    Metric(
        "vertical error, mean", "m", f"{ISO}, 8.4", "mean difference of heights, without sign",
        lambda c: c.vertical.mean_m if c.vertical else None,
    ),
    Metric("VE95", "m", f"{ISO}, 8.10", "95 % of the differences of heights are below it", lambda c: c.ve95_m),
    Metric(
        "3D error, mean", "m", f"{ISO}, 8.4", "mean distance in space",
        lambda c: c.spherical.mean_m if c.spherical else None,
    ),
    Metric(
        "3D error, rms", "m", f"{ISO}, 8.7", "root of the mean square in space",
        lambda c: c.spherical.rms_m if c.spherical else None,
    ),
    Metric("SE95", "m", f"{ISO}, 8.11", "95 % of the distances in space are below it", lambda c: c.se95_m),
    Metric("floor detection", "%", f"{ISO}, 8.2", "share of the points on the right floor", lambda c: c.floor_probability),
    Metric(
        "zone detection", "%", f"{ISO}, 8.3", "share of the points in the right room, corridor, stairs or lift",
        lambda c: c.zone_probability,
    ),
    Metric(
        "coverage", "%", f"{ISO}, 8.12", "share of the square metres that the truth visits with a position",
        lambda c: c.coverage,
    ),
    Metric(
        "availability", "%", f"{ISO}, 8.16.2", f"share of the truth's time with a position at most {GAP_S:g} s old, not lost",
        lambda c: c.availability,
    ),
    Metric("latency, mean", "s", f"{ISO}, 8.14", "from the moment of a row until it was out", lambda c: c.latency_mean_s),
    Metric("latency, 95 %", "s", f"{ISO}, 8.14", "95 % of the latencies are below it", lambda c: c.latency_p95_s),
    Metric(
        "EvAAL score", "m", EVAAL, f"third quartile of horizontal error + {FLOOR_PENALTY_M:g} m per wrong floor",
        lambda c: c.evaal_m,
    ),
    Metric(
        "95 % ellipse holds", "%", "", "share of the points whose 95 % ellipse has the truth in it",
        lambda c: c.ellipse95_holds,
    ),
    Metric(
        "95 % radius holds", "%", STANFORD, "share of the points whose error is within the stated 95 % radius",
        lambda c: c.radius95_holds,
    ),
    Metric(
        "protection radius holds", "%", STANFORD, "share of the points whose error is within the protection radius",
        lambda c: c.protection_holds,
    ),
)  # fmt: skip


def notes(card: Scorecard) -> list[str]:
    """Remarks on the figures."""
    notes = [f"{card.track}: {card.points} points in {card.span_s:.1f} s"]
    if not card.evaal_knows_floors:
        notes.append("No floor is stated by both files: the EvAAL score takes all points as on the right floor.")
    return notes


def as_text(value: float | None, unit: str) -> str:
    """A figure with its unit; a dash if missing."""
    if value is None or math.isnan(value):
        return "-"
    if unit == "%":
        return f"{100.0 * value:.2f} %"
    return f"{value:.3g} s" if unit == "s" else f"{value:.2f} {unit}"
