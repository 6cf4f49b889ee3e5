# SPDX-License-Identifier: MIT
"""Shares of heard pings by angle, in a corridor where every distance is known."""

from __future__ import annotations

import math
from collections.abc import Iterator

import pytest

from echostep_app.session.acceptance.heard import HeardShare, SeenPing, heard_shares
from echostep_app.session.acceptance.survey import corridor

PLAN = corridor("20x2").plan()


def ping(off_deg: float, range_m: float, ranger: int = 0) -> SeenPing:
    """From the middle of the corridor, so many degrees off the left wall's normal."""
    return SeenPing(10.0, 1.0, 0, math.radians(90.0 + off_deg), ranger, range_m)


def of(shares: list[HeardShare], ranger: str) -> Iterator[HeardShare]:
    return (share for share in shares if share.ranger == ranger)


def test_each_ping_counts_at_its_angle() -> None:
    pings = [ping(a, 1.0) for a in (-5.0, 5.0, 15.0, -35.0, 55.0)]
    shares = heard_shares(pings, PLAN)
    assert [(s.from_deg, s.pings) for s in of(shares, "both")] == [(0, 2), (10, 1), (30, 1), (50, 1)]
    assert all(s.wall == 1.0 for s in shares)


@pytest.mark.parametrize(
    ("off_deg", "range_m", "kind"),
    [
        (0.0, 1.25, "wall"),
        (0.0, 1.35, "farther"),
        (0.0, 0.65, "nearer"),
        (0.0, math.nan, "none"),
        (60.0, 2.2, "wall"),
        (60.0, 2.4, "farther"),
    ],
)
def test_an_echo_is_that_walls_nearer_or_farther(off_deg: float, range_m: float, kind: str) -> None:
    """Along the axis the wall is 1 m away square on, 2 m at 60 degrees."""
    (share,) = of(heard_shares([ping(off_deg, range_m)], PLAN), "both")
    assert {name: getattr(share, name) for name in ("wall", "nearer", "farther", "none")} == {
        name: float(name == kind) for name in ("wall", "nearer", "farther", "none")
    }


def test_rangers_are_told_apart_and_far_walls_left_out() -> None:
    shares = heard_shares([ping(0.0, 1.0), ping(180.0, math.nan, ranger=1), ping(90.0, 1.0)], PLAN)
    assert [(s.ranger, s.pings, s.wall) for s in shares] == [("left", 1, 1.0), ("right", 1, 0.0), ("both", 2, 0.5)]


def test_no_ping_is_no_share() -> None:
    assert heard_shares([], PLAN) == []
    assert heard_shares([SeenPing(100.0, 100.0, 0, 0.0, 0, 1.0)], PLAN) == []
