# SPDX-License-Identifier: MIT
"""One fact, one word: three wearers, a commander, a broker that freezes, is slow and dies; at no moment do two surfaces say different things.

In simulated time, a look each quarter of a second: list, summary, details, map, JSON, TAK's remarks, the wearer's own page and receipt.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from echostep.localization import Estimate, TrackStatus
from echostep_app.operation.requests import Acknowledge, SetOrder
from echostep_app.team.commander import as_tree
from echostep_app.team.cot import remarks
from echostep_app.team.inbox import ReceivedMessage
from echostep_app.team.messages.report import Presence, Report, ReportedAlarm, encode
from echostep_app.team.outbox import HEARTBEAT_S, stamped
from echostep_app.team.publish import position_of
from echostep_app.wearer.steady_status import span_words
from operation.teams import BASE, TOWER, Team
from team.network import feed_of

STEP_S = 0.25
RADIUS = re.compile(r"±([\d.]+) m")


class Wearer:
    """A run that sends an estimate each half second; `stopped`: the sensors are silent, heartbeats go on."""

    def __init__(self, name: str) -> None:
        self.name, self.stopped, self.ended, self.alarm = name, False, False, False
        _, self.feed = feed_of("mqtt://localhost", name)
        self.estimate = Estimate(0.0, 12.0, 7.5, 0.01, 0.0, 0.01, 0.0, 0.02, 0, TrackStatus.TRACKING)
        self._sequence, self._sent_s = 0, -1.0

    def report(self, now_s: float, unix_s: float) -> Report:
        alarm = ReportedAlarm("mayday", "help", 1, 0.0) if self.alarm else None
        position = position_of(TOWER.levels, self.estimate)
        known = replace(BASE, name=self.name, plan_sha256=TOWER.digest, position=position, alarm=alarm)
        return stamped(known, self._sequence, unix_s, now_s - self.estimate.t_s, 0)

    def sent(self, now_s: float, unix_s: float) -> Iterator[tuple[str, bytes]]:
        if self.ended:
            return
        if not self.stopped:
            self.estimate = replace(self.estimate, t_s=now_s, x_m=12.0 + 0.1 * now_s % 5.0)
        if now_s - self._sent_s >= (HEARTBEAT_S if self.stopped else 0.5):
            self._sequence, self._sent_s = self._sequence + 1, now_s
            yield f"echostep/red/{self.name}/estimate", encode(self.report(now_s, unix_s))


def agree(team: Team, wearers: dict[str, Wearer], on_the_way_s: float) -> None:
    """All surfaces, at this moment; a report is so long on the way."""
    now_s, scene = team.now_s, team.scene()
    members, plan = team.operation.roster.members(now_s), team.plan
    tree = {m["name"]: m for m in as_tree(team.operation.roster, plan, now_s)["members"]}
    places = {row[0]: row[5:] for row in np.frombuffer(scene.places, "<f4").reshape(-1, 7).tolist()}
    assert {row.name: row.state for row in scene.rows} == {m.report.name: m.state(now_s).value for m in members}
    assert sum(map(int, re.findall(r"[:,] (\d+)", scene.summary))) == len(members)
    for m in members:
        team.operation._changed = True  # or the ages are up to LIST_S old
        row = next(row for row in team.scene().rows if row.name == m.report.name)
        r, silent_s, words = m.at(now_s), m.silent_s(now_s), f"{row.name}: {row.words}"
        p, said = r.last_known, RADIUS.search(row.words)
        facts, _ = team.details(row.id)
        assert p
        assert row.state == tree[row.name]["state"] == facts["state"] == m.state(now_s).value, words
        claims = said is not None  # one and the same everywhere
        assert claims == ("last known" not in words) == np.isfinite(places[row.id][0]), words
        assert claims == (facts["place"] != "not known") == ("place not known" not in remarks(r)), words
        assert abs((tree[row.name]["radius95_m"] or 0.0) - p.radius95_m) < 1e-9
        if said:
            assert float(said[1]) == pytest.approx(places[row.id][0], abs=0.06), words
            assert r.status != "tracking" or p.radius95_m <= 1.0, words
        assert p.age_s >= silent_s - 1e-6, words  # no place is newer than the report that has it
        known = f"last known {span_words(p.age_s)} ago"
        assert claims or known in words, words
        assert claims or known in remarks(r), words
        assert row.open_alarm == (row.state == "mayday" and not any("acknowledged by" in note for note in row.notes))
        own = wearers[row.name]
        assert silent_s or on_the_way_s or r.status == own.report(now_s, team.unix_s).status, words
        answer = own.feed.answer_to(1)
        assert "acknowledged it." not in answer or not row.open_alarm, words
        assert not answer or row.state == "mayday" or not own.alarm, words


def test_at_no_moment_two_surfaces_say_different_things(monkeypatch: pytest.MonkeyPatch) -> None:
    team, wearers = Team(now_s=0.0), {name: Wearer(name) for name in ("anna", "bo", "cy")}
    broker = SimpleNamespace(delay_s=0.0, frozen=False, dead=False, waiting=list[tuple[float, str, bytes]]())
    monkeypatch.setattr("time.time", lambda: team.unix_s)
    words: dict[str, list[str]] = {name: [] for name in wearers}

    def put(topic: str, payload: bytes) -> None:
        if not broker.dead:
            broker.waiting.append((team.now_s + broker.delay_s, topic, payload))

    def come() -> list[tuple[str, bytes]]:
        due = [one for one in broker.waiting if one[0] <= team.now_s and not broker.frozen]
        broker.waiting = [one for one in broker.waiting if one not in due]
        return [(topic, payload) for _, topic, payload in due]

    def end(name: str) -> None:
        wearers[name].ended = True
        put(f"echostep/red/{name}/presence", encode(Presence(1, BASE.run, "ended")))

    def ask(request: Any) -> None:
        message = team.operation.act(request, team.unix_s, team.now_s)
        assert isinstance(message, tuple)
        put(*message)

    def go(seconds: float) -> None:
        for _ in range(int(seconds / STEP_S)):
            team.pass_time(STEP_S)
            for wearer in wearers.values():
                for message in wearer.sent(team.now_s, team.unix_s):
                    put(*message)
                own = wearer.report(team.now_s, team.unix_s)  # what its own page says: the same word, the same radius
                shown = wearer.estimate.unobserved(team.now_s)
                if team.now_s - wearer.estimate.t_s > HEARTBEAT_S and own.last_known:
                    assert shown.status.value == own.status
                    assert shown.ellipse95.major_m == pytest.approx(own.last_known.radius95_m)
            for message in (*come(), *team.operation.take_answers()):
                team.put_bytes(*message)
                for wearer in wearers.values():
                    if message[0].startswith("echostep-table/"):
                        wearer.feed._receive(ReceivedMessage(*message, False, team.now_s, team.unix_s))
            agree(team, wearers, broker.delay_s)
            for row in team.scene().rows:
                if words[row.name][-1:] != [row.state]:
                    words[row.name].append(row.state)

    go(5.0)
    wearers["bo"].stopped = True  # the sensors fall silent
    go(6.0)
    wearers["bo"].stopped = False
    broker.frozen = True
    wearers["anna"].alarm = True
    go(3.0)
    assert wearers["anna"].feed.answer_to(1) == ""
    broker.frozen = False
    go(1.0)
    assert wearers["anna"].feed.answer_to(1).startswith("A commander's screen shows it")
    ask(Acknowledge(team.scene().rows[0].id, "Ann"))
    broker.delay_s = 2.5
    go(12.0)
    assert wearers["anna"].feed.answer_to(1) == "Ann has acknowledged it."
    end("cy")
    go(130.0)
    ask(SetOrder("commander"))
    broker.dead = True
    go(15.0)
    broker.delay_s, broker.dead = 0.0, False
    go(5.0)
    assert {name: one.feed.orders() != () for name, one in wearers.items()} == dict.fromkeys(wearers, True)
    wearers["anna"].alarm = False
    go(1.0)
    end("anna")
    end("bo")
    go(300.0)
    assert team.scene().order is None
    assert not any(one.feed.orders() for one in wearers.values())
    assert words["bo"][:4] == ["tracking", "uncertain", "lost", "tracking"], words
    assert words["cy"][-1] == words["anna"][-1] == "ended", words
