# SPDX-License-Identifier: MIT
"""A wall clock that is set back or forward during a run: only what is named here reads it, and none of it moves a position, an age or an alarm."""

from __future__ import annotations

import re
import time
from pathlib import Path

import pytest

import echostep
import echostep_app
from echostep_app.operation import requests
from echostep_app.operation.operation import Operation
from echostep_app.team.messages.marks import MarkBoard
from echostep_app.team.messages.report import ReportedAlarm, encode
from echostep_app.team.outbox import stamped
from echostep_app.team.roster import MemberState, Roster
from team.team_reports import POSITION, report
from walks import PLAN

READS = re.compile(r"\btime\.time(_ns)?\(|\bdatetime\.now\(|\btime\.(localtime|gmtime)\(")
HOUR_S = 3600.0
# Reads the time of day, and for what
READERS = {
    "commands/actions/beacon_player.py": "a counter that never decreases",
    "operation/command.py": "times of day that the page shows",
    "operation/recorded/record.py": "when it was begun, for people",
    "operation/session.py": "when marks, acknowledgements and errands were made, by this commander's clock",
    "recording/names.py": "a name, which has its number before the time",
    "session/last_place.py": "when the place was kept",
    "session/metadata.py": "when it was begun, for people and for exports",
    "session/runs/live.py": "how old the kept place is",
    "session/team/feeds.py": "when an order was understood, and that it is not yesterday's; the name of a drawing",
    "team/inbox.py": "when a message came, to compare the sender's clock",
    "team/outbox.py": "when a report was sent",
}


def test_no_other_module_reads_the_wall_clock() -> None:
    packages = (Path(str(package.__file__)).parent for package in (echostep, echostep_app))
    found = {str(p.relative_to(at)) for at in packages for p in at.rglob("*.py") if READS.search(p.read_text())}
    assert found == set(READERS)


@pytest.mark.parametrize("step_s", [-HOUR_S, HOUR_S])
def test_a_trackers_clock_that_steps_changes_no_state_and_is_noted(step_s: float) -> None:
    roster, began_s, unix_s = Roster(), time.monotonic(), time.time()
    for k in range(1, 21):
        moment_s = unix_s + 0.5 * k + (step_s if k > 10 else 0.0)
        sent = stamped(report(alarm=ReportedAlarm("mayday", "fall", 1, 0.5 * k)), k, moment_s, 0.0, 0)
        assert roster.receive("echostep/red/anna/estimate", encode(sent), False, began_s + 0.5 * k, unix_s + 0.5 * k)
    (member,) = roster.members(began_s + 10.0)
    assert member.state(began_s + 10.0) is MemberState.MAYDAY
    assert (member.report.alarm and member.report.alarm.age_s, member.silent_s(began_s + 10.0)) == (10.0, 0.0)
    assert member.report.position
    assert member.report.position.radius95_m == POSITION.radius95_m
    assert abs(member.clock_ahead_s - step_s) < 1.0


@pytest.mark.parametrize("step_s", [-HOUR_S, HOUR_S])
def test_a_commander_whose_clock_steps_can_send_again(step_s: float) -> None:
    """A newer errand replaces an older one, whatever this commander's clock says."""
    operation, now_s, unix_s = Operation(PLAN), time.monotonic(), time.time()
    rescued = report("anna", alarm=ReportedAlarm("mayday", "fall", 1, 31.0))
    for made in (rescued, report("bo")):
        assert operation.roster.receive(f"echostep/red/{made.name}/estimate", encode(made), False, now_s, unix_s)
    operation.receive([], {}, now_s, unix_s)
    numbers = {row.name: row.id for row in operation.scene(now_s, unix_s).rows}
    wearer = MarkBoard()
    for by, at_s in (("Ann", unix_s), ("Ben", unix_s + step_s)):
        message = operation.act(requests.Send(numbers["bo"], numbers["anna"], by), at_s, now_s)
        assert not isinstance(message, str), message
        wearer.receive(*message)
        operation._board.receive(*message)
        (errand,) = wearer.errands.values()
        assert errand.by == by
