# SPDX-License-Identifier: MIT
"""Drawings of other wearers: what is believed of a payload, and `--plan wearer:NAME` from a real broker to a file."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import pytest

from command_line import echostep, interrupt_once_called
from echostep.errors import EchostepError
from echostep.plan import load_plan
from echostep_app.operation.operation import Operation
from echostep_app.team import inbox, wearer_plan
from echostep_app.team.endpoint import parse_endpoint
from echostep_app.team.inbox import MOST_TRIES, ListenerThread
from echostep_app.team.messages.report import WITHOUT_PLAN
from echostep_app.team.messages.shared_drawings import (
    MOST_BYTES,
    MOST_STOREYS,
    MOST_WALLS,
    checked_drawing,
    drawing_topic,
)
from echostep_app.team.mqtt.publisher import Listener
from echostep_app.team.wearer_plan import drawing_wearer, plan_file
from team.network import box_to
from team.team_broker import Broker, needs_broker
from team.team_reports import report
from waiting import PATIENCE_S, until

WALLS = [[0.0, 0.0, 9.0, 0.0], [0.0, 2.0, 9.0, 2.0]]


def drawing(walls: Any = WALLS, storeys: int = 1, name: str = "drawn by anna", **more: Any) -> bytes:
    levels = [{"name": str(k), "height_m": 3.0 * k, "walls": walls, "rooms": []} for k in range(storeys)]
    tree = {"echostep_plan": 1, "name": name, "uncertainty_m": 0.05, "levels": levels}
    return json.dumps(tree | {"start": {"x": 1.0, "y": 1.0, "heading_deg": 90.0}} | more).encode()


CORNERS = [[k % 9, 7 * k % 9] for k in range(7500)]


def level(**parts: Any) -> bytes:
    """A drawing of two walls with other parts."""
    return drawing(levels=[{"name": "0", "walls": WALLS, **parts}])


def test_a_drawing_is_a_plan() -> None:
    plan = checked_drawing(drawing())
    assert (plan.name, len(plan.levels[0].walls), plan.uncertainty_m) == ("drawn by anna", 2, 0.05)


@pytest.mark.parametrize(
    ("payload", "why"),
    [
        (b"", "not a plan"),
        (b"\xff", "not a plan"),
        (b"[" * 5000, "not a plan"),
        (b"{}", "expected 1"),
        (drawing(walls=[]), "it shows no wall"),
        (drawing(walls=[[0, 0, 1e999, 0]]), "not a finite number"),
        (drawing(walls=[[0, 0, 90_000, 0]]), "m of wall, more than"),
        (drawing(walls=[[0, 0, 1, 0], [9_000, 0, 9_001, 0]]), "m from end to end"),
        (drawing(walls=[[0, 0, 1, 0]] * (MOST_WALLS + 1)), "10001 walls, more than 10000"),
        (drawing(storeys=MOST_STOREYS + 1), "65 storeys, more than 64"),
        (drawing(name="\x1b[2Janna"), "without control characters"),
        (level(rooms=[{"name": "\u202eanna", "at": [1, 1]}]), "a name in it is not printable"),
        (level(rooms=[{"name": "a", "at": [1, 1]}] * 2001), "2001 doors, rooms, connectors and the like, more than"),
        (level(rooms=[{"name": "a", "at": [90_000, 1]}]), "m from end to end"),
        (level(doors=[{"line": [0, 0, 0, 90_000]}]), "m from end to end"),
        (level(doubtful=[[0, 0, 0, 90_000]]), "m from end to end"),
        (level(place_sd=[[0, 90_000, 0.1]]), "m from end to end"),
        (level(place_sd=[[0, 0, 0.1]], doubtful=WALLS * 5000), "10002 walls, more than"),
        (level(walls=[], place_sd=[[0, 0, 1.5]], doubtful=WALLS), r"refused as a plan: .* known to 1.5 m only"),
        (level(obstacles=[[[0, 0], [9, 0], [9, 90_000]]]), "m of wall, more than"),
        (level(rooms=[{"name": "a", "at": [1, 1], "outline": CORNERS}] * 2), "15000 corners of outlines, more than"),
        (drawing(start={"x": 90_000.0, "y": 1.0, "heading_deg": 90.0}), "m from end to end"),
        (drawing(walls=[[0, 0.01 * k, 4, 4 - 0.01 * k] for k in range(500)]), "of its walls meet or cross"),
        (b" " * (MOST_BYTES + 1), "bytes, more than"),
    ],
)
def test_what_no_walk_can_have_drawn_is_refused_in_a_sentence(payload: bytes, why: str) -> None:
    with pytest.raises(EchostepError, match=why) as refusal:
        checked_drawing(payload)
    assert "\n" not in str(refusal.value)


def test_a_plan_is_a_wearers_by_its_prefix_alone() -> None:
    assert drawing_wearer(None) is None
    assert drawing_wearer(Path("wearer.json")) is None
    assert drawing_wearer(Path("wearer:anna")) == "anna"
    for wrong in ("wearer:", "wearer:a/b", "wearer:+", "wearer:" + 40 * "a"):
        with pytest.raises(EchostepError, match="--plan wearer:"):
            drawing_wearer(Path(wrong))
    assert plan_file(Path("office.json"), None, "red", Path("nowhere"), print) == Path("office.json")


@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        (("live", "--board", "nowhere"), "needs the team's broker, mqtt://HOST"),
        (("live", "--board", "nowhere", "--publish", "cot+udp://127.0.0.1", "--name", "bo"), "needs the team's broker"),
        (("demo",), "needs the team's broker"),
        (("command", "mesh:///dev/null"), "needs the team's broker"),
        (("replay", "walk.mcap"), "the file drawing-anna-"),
    ],
)
def test_without_a_broker_a_drawing_cannot_come(tmp_path: Path, arguments: tuple[str, ...], why: str) -> None:
    done = echostep(*arguments, "--plan", "wearer:anna", cwd=tmp_path)
    assert (done.returncode, why in done.stderr) == (2, True), done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


def keep(broker: Broker, payload: bytes, name: str = "anna") -> None:
    """Have the broker keep a drawing."""
    sender = Listener(parse_endpoint(broker.url), ["nothing"], lambda *_: None)
    sender.open()
    sender.publish(drawing_topic("red", name), payload)
    sender.close()


@needs_broker
def test_a_drawing_comes_from_the_broker_into_a_file_that_stays(tmp_path: Path) -> None:
    """A large one too; the same one again is the same file, a newer one another; a file with other bytes is put aside."""
    walls = [[0.0, round(0.01 * k, 2), 4.0, round(0.01 * k, 2)] for k in range(8000)]
    large = drawing(walls=walls)
    assert len(large) > 3 * 65_536
    said: list[str] = []
    with Broker(tmp_path) as broker:
        fetch = fetcher(broker, tmp_path / "out", said)
        keep(broker, large)
        path = fetch("red")
        assert path == fetch("+")
        assert path.read_bytes() == large
        assert load_plan(path).digest == checked_drawing(large).digest
        keep(broker, drawing())
        newer = fetch("red")
        assert newer.read_bytes() == drawing()
        assert path.read_bytes() == large
        newer.write_bytes(b"mine")
        assert fetch("red") == newer
        assert newer.read_bytes() == drawing()
        aside = newer.with_name(f"{newer.name}.damaged")
        assert aside.read_bytes() == b"mine"
    assert "drawn by anna: 8000 walls, to 5 cm (1 sd)" in said[1]
    assert sorted(tmp_path.glob("out/*")) == sorted([path, newer, aside])


def fetcher(broker: Broker, folder: Path, said: list[str]) -> Callable[[str], Path]:
    def fetch(team: str) -> Path:
        path = plan_file(Path("wearer:anna"), parse_endpoint(broker.url), team, folder, said.append)
        assert path is not None
        return path

    return fetch


@needs_broker
def test_a_commander_sees_those_who_are_on_a_drawing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One wearer is on it, the one who draws it on none."""
    interrupt_once_called(Operation, "receive", monkeypatch, lambda operation, *_: len(operation.roster.keys) == 2)
    with Broker(tmp_path) as broker:
        keep(broker, drawing())
        on_it = report("bo", plan_sha256=hashlib.sha256(drawing()).hexdigest())
        draws = report("anna", plan_sha256=WITHOUT_PLAN)
        boxes = [box_to(broker.url, name=made.name) for made in (on_it, draws)]
        for box, made in zip(boxes, (on_it, draws), strict=True):
            box.offer(made)
        assert until(lambda: all(box.counts.sent == 1 for box in boxes))
        arguments = (broker.url, "--plan", "wearer:anna", "--no-page", "--json")
        done = echostep("command", *arguments, "--out", "out/operation.mcap", cwd=tmp_path)
        for box in boxes:
            box.close()
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert told["plan"] == "drawn by anna"
    notes = {member["name"]: [note for note in member["notes"] if "plan" in note] for member in told["members"]}
    assert notes == {"bo": [], "anna": ["tracked without a plan"]}
    assert len(list((tmp_path / "out").glob("drawing-anna-*.json"))) == 1


@needs_broker
def test_a_hostile_drawing_ends_the_command_in_a_sentence_and_leaves_no_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    looked = Mock(wraps=checked_drawing)
    monkeypatch.setattr(wearer_plan, "checked_drawing", looked)
    over = SimpleNamespace(monotonic=lambda: wearer_plan.WAIT_S * looked.call_count)  # once one was looked at
    monkeypatch.setattr(wearer_plan, "time", over)
    with Broker(tmp_path) as broker:
        keep(broker, drawing(walls=[[0, 0, "x", 0]]))
        arguments = ("--plan", "wearer:anna", "--publish", broker.url, "--name", "bo", "--team", "red", "--out", "out")
        done = echostep("live", "--board", "nowhere", *arguments, cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr.startswith(f"echostep: --plan wearer:anna: the drawing on {broker.url} is not used: levels[0]")
    assert len(done.stderr.strip().splitlines()) == 1
    assert not list(tmp_path.glob("**/drawing-*"))


@needs_broker
def test_drawings_that_cannot_be_used_are_told_once_and_the_next_is_taken(tmp_path: Path) -> None:
    """They change quickly, and of those that wait only the newest is looked at."""
    said: list[str] = []
    with Broker(tmp_path) as broker:
        keep(broker, b"\xff")
        with ThreadPoolExecutor(1) as pool:
            path = pool.submit(fetcher(broker, tmp_path / "out", said), "red")
            assert until(lambda: any("not used" in line for line in said))
            for k in range(200):
                keep(broker, drawing(walls=[[0, 0, 60_000 + k, 0]]))
            keep(broker, drawing())
            assert path.result(PATIENCE_S).read_bytes() == drawing()
    assert len([line for line in said if "not used, waiting for another: not a plan" in line]) == 1
    assert len(said) == 3


@needs_broker
def test_a_drawing_that_does_not_come_is_not_waited_for_without_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The wearer of another team is not meant, and an empty message is what a broker sends when it was told to forget."""
    monkeypatch.setattr(wearer_plan, "WAIT_S", 1.0)
    with Broker(tmp_path) as broker:
        keep(broker, drawing(), "eve")
        keep(broker, b"")
        with pytest.raises(EchostepError, match=r"no drawing came from .* in 1 s: does anna walk without a plan"):
            fetcher(broker, tmp_path, [])("red")


class Refusing:
    """A broker at whose connection one message breaks; the others are taken."""

    def __init__(self, poison: bytes) -> None:
        self.opened = 0
        self.taken: list[bytes] = []
        self._poison = poison

    def open(self) -> str:
        self.opened += 1
        return ""

    def run_once(self, timeout_s: float) -> None:
        """Nothing comes."""

    def publish(self, topic: str, payload: bytes) -> None:
        if payload == self._poison:
            raise ConnectionError(f"{topic} breaks it")
        self.taken.append(payload)

    def close(self) -> None:
        """Nothing to close."""


def test_a_message_that_breaks_the_connection_every_time_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """Those behind it come through."""
    monkeypatch.setattr(inbox, "RETRY_PAUSES_S", (0.0,))
    broker, said = Refusing(b"too large"), list[str]()
    receiver = ListenerThread(broker, said.append)
    assert not receiver.waiting
    receiver.send("drawing", b"too large")
    receiver.send("mark", b"small")
    assert until(lambda: broker.taken == [b"small"])
    assert until(lambda: not receiver.waiting)
    receiver.close()
    assert broker.opened == MOST_TRIES + 1
    assert "a message of 9 bytes on drawing is given up: the broker does not take it" in said
