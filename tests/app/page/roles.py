# SPDX-License-Identifier: MIT
"""The page of either role, with one wearer at a place of a plan."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

from echostep.plan import Plan
from echostep_app.page.mailbox import Mailbox
from operation.teams import ServedTeam, Team, place
from page.browser import READY, TABLE_READY
from page.frames import scene, served, told


@contextmanager
def role_page(
    role: str, plan: Plan, at: tuple[float, float], level: int, heading_rad: float = 0.0
) -> Iterator[tuple[str, str]]:
    """The page's address, and the expression that holds when it is drawn."""
    if role == "commander":
        team = Team(plan)
        team.hear("Anna", place(plan, *at, level, heading_rad=heading_rad))
        with ServedTeam(team) as of_team:
            yield of_team.page.url, TABLE_READY
        return
    shares = tuple(float(k == level) for k in range(len(plan.levels)))
    estimate = replace(told(*at), level=level, levels=shares, heading_rad=heading_rad)
    with served(Mailbox(plan, "test", replay=False)) as (server, mailbox):
        mailbox.publish(
            replace(scene(), estimate=estimate, echo_lines=(), particles=None, status_text="tracking, 0.2 m")
        )
        yield server.url, READY
