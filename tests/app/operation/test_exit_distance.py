# SPDX-License-Identifier: MIT
"""A commander sees how far each wearer's way out is, over stairs and round walls."""

from __future__ import annotations

from dataclasses import replace

from operation.teams import Team, place
from page.elements.test_page_way_out import HOUSE
from waiting import until

BUILT = replace(HOUSE, digest="7" * 64)


def test_the_list_says_how_far_the_exit_is() -> None:
    team = Team(BUILT)
    team.hear("Kim", place(BUILT, 12.0, 5.0, 0))
    team.hear("Bo", place(BUILT, 12.0, 5.0, 1))
    team.hear("Eve", None)

    def words() -> dict[str, str]:
        team.pass_time(1.0)
        return {row.name: row.words for row in team.scene().rows}

    assert until(lambda: "m to the exit" in words()["Kim"])  # its grids are laid in a thread
    said = words()
    assert "9 m to the exit" in said["Kim"]
    assert "m to the exit" in said["Bo"]
    assert "exit" not in said["Eve"]
    team.hear("Kim", place(BUILT, 17.0, 5.0, 0))
    assert "4 m to the exit" in words()["Kim"]
