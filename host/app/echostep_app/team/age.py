# SPDX-License-Identifier: MIT
"""Age: what a position and a report still say some seconds later.

In: positions and reports, seconds since they were true. Out: the same at that time. Owns nothing. The one rule that makes a word
from radius and age, for reports, TAK and commanders: late is not lost. After SETTLED_S the 95 % radius has grown at WALKER_M_S, and the status is
that of the radius; `Estimate.unobserved` is the same rule on the wearer's side.
"""

from __future__ import annotations

from dataclasses import replace

from echostep.localization import TrackStatus
from echostep.particles.ellipse import widening_m2
from echostep.particles.limits import WALKER_M_S
from echostep_app.team.messages.report import Position, Report
from echostep_app.wearer.steady_status import SETTLED_S

LONGEST_S = 1e5  # the radius stops to grow after so long, about a day
WORSE = ["waiting", *(status.value for status in TrackStatus)]


def later(report: Report, seconds: float) -> Report:
    """A report so many seconds later: all ages grow, the status is no better than that of the grown radius."""
    if seconds <= 0.0:
        return report
    position, last = (p and aged(p, seconds) for p in (report.position, report.last_place))
    alarm, motion, place = report.alarm, report.motion, report.place
    if place and position and report.position:
        variance_m2 = place.sd_m**2 + position.xx_m2 - report.position.xx_m2
        place = replace(place, sd_m=variance_m2**0.5)
    report = replace(
        report,
        position=position,
        last_place=last,
        place=place,
        alarm=alarm and replace(alarm, age_s=alarm.age_s + seconds),
        motion=motion and replace(motion, still_s=motion.still_s + seconds),
    )
    return no_better(report, TrackStatus.of(position.radius95_m)) if position and position.age_s > SETTLED_S else report


def no_better(report: Report, status: str) -> Report:
    """The report with the worse of its status and this one; a lost wearer has no position and no place on Earth, but a last place."""
    worst = max(report.status, status, key=WORSE.index)
    last = report.position or report.last_place
    if worst == "lost":
        return replace(report, status="lost", position=None, place=None, last_place=last)
    return report if worst == report.status else replace(report, status="uncertain")


def aged(position: Position, seconds: float) -> Position:
    """A position so many seconds later; beyond SETTLED_S both radii have grown at WALKER_M_S since the estimate."""
    age_s = position.age_s + seconds
    by_m = _walked_m(age_s) - _walked_m(position.age_s)
    more, protection = widening_m2(position.radius95_m, by_m), position.protection_m
    return replace(
        position,
        age_s=min(age_s, 1e9),
        xx_m2=position.xx_m2 + more,
        yy_m2=position.yy_m2 + more,
        radius95_m=position.radius95_m + by_m,
        protection_m=protection and min(protection + by_m, 1e7),
    )


def _walked_m(age_s: float) -> float:
    return WALKER_M_S * min(age_s, LONGEST_S) if age_s > SETTLED_S else 0.0
