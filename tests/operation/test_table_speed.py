# SPDX-License-Identifier: MIT
"""Measurements of the commander's page in Chromium (`make page-speed`): printed, not judged, since they depend on the machine's load."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from typing import Any

import pytest

from echostep.page.guarded_socket import FRAME_S
from operation.teams import FLOORS, STOREYS, ServedTeam, Team
from operation.test_table_page import table
from team.team_reports import POSITION

WEARERS, RATE_HZ, SPAN_S = 200, 10.0, 5.0


@pytest.mark.speed
def test_frame_rate_with_200_wearers(browser: Any) -> None:
    """200 wearers report ten times a second each, spread evenly over time."""
    team = Team()
    team.gathers = True
    walks(team, 0.0, range(WEARERS))
    team.receive()
    with ServedTeam(team) as served:
        page = table(browser, served.page.url, "wide")
        for floor in range(STOREYS):
            page.click(f"#floors button:nth-child({floor + 1})")
            rate_hz, behind_s, cost = measured(page, served)
            print(
                f"200 wearers, floor {floor}: {rate_hz:.1f} frames/s; {100.0 * cost:.0f} % of a core reads and encodes"
            )
            assert behind_s < SPAN_S
        assert page.locator("#list li").count() == WEARERS
        assert not page.wrong
        page.context.close()


def measured(page: Any, served: ServedTeam) -> tuple[float, float, float]:
    """Frames drawn a second, seconds behind the clock at the end, and the share of a core that the reports and scenes take."""
    team, busy_s = served.team, 0.0
    began, frames, k, next_one = time.monotonic(), page.evaluate("echostep.frames"), 0, 0
    while (now := time.monotonic()) - began < SPAN_S:
        due = int((now - began) * RATE_HZ * WEARERS)
        team.now_s, team.unix_s = now, team.unix_s + FRAME_S
        walks(team, now - began, [n % WEARERS for n in range(next_one, due)])
        cpu_s = time.thread_time()
        team.receive()
        served.show()
        busy_s += time.thread_time() - cpu_s
        next_one, k = due, k + 1
        time.sleep(max(began + k * FRAME_S - time.monotonic(), 0.0))
    span_s = time.monotonic() - began
    return (page.evaluate("echostep.frames") - frames) / span_s, span_s - SPAN_S, busy_s / span_s


def walks(team: Team, t_s: float, numbers: Any) -> None:
    """Reports of these wearers, who walk in circles."""
    for n in numbers:
        angle = 0.2 * t_s + n
        x_m, y_m = 15.0 + 12.0 * math.cos(angle), 4.0 + 3.0 * math.sin(1.7 * angle)
        floor, heading_rad = n % STOREYS, math.remainder(angle, math.tau)
        at = replace(POSITION, x_m=x_m, y_m=y_m, floor=floor, floor_name=FLOORS[floor], where="in the corridor")
        team.hear(f"wearer {n:03d}", replace(at, heading_rad=heading_rad, protection_m=0.4))
