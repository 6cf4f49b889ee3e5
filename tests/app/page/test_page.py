# SPDX-License-Identifier: MIT
"""The page's server: hostile sockets, slow pages, check-ins that replay bit for bit."""

from __future__ import annotations

import itertools
import json
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from echostep.localization import Estimate, digest
from echostep.particles.limits import BELIEVED, PROBABLE
from echostep.plan import Pose
from echostep.ports.chunks import Chunk, portion_of
from echostep.ports.people.check_in import PERSON, Call, CheckIn, Undo, parse_person
from echostep.tracker import Tracker
from echostep_app.page import requests
from echostep_app.page.live import LivePage
from echostep_simulation.scenario import START_NS, Scenario
from page.frames import LOCAL, PLAN, next_frame, opened_url
from waiting import PATIENCE_S

json_like = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=6,
)


fields = st.sampled_from(
    ["x_m", "y_m", "sd_m", "heading_rad", "level", "seq", "playing", "times", "t_s", "by", "undo", "name"]
)
kinds = st.sampled_from(
    [
        "check_in",
        "undo",
        "consider",
        "go_to",
        "go_nowhere",
        "drawn",
        "play",
        "speed",
        "seek",
        "step",
        "met",
        "?",
    ]
)


@pytest.mark.slow
@given(kinds, st.dictionaries(fields, json_like, max_size=6))
def test_no_request_breaks_the_parser(kind: str, rest: dict[str, object]) -> None:
    requests.parse_request(json.dumps({"kind": kind, **rest}))


@given(st.text() | st.just("[" * 2000) | st.just("9" * 2000) | json_like.map(json.dumps))
def test_no_text_breaks_the_parser(text: str) -> None:
    assert requests.parse_request(text) is None or '"kind"' in text


@pytest.mark.parametrize(
    "text",
    [
        '"kind":"seek","t_s":1e308', '"kind":"seek","t_s":NaN', '"kind":"seek","t_s":1e999', '"kind":"seek","t_s":true', '"kind":"speed","times":0',
        '"kind":"speed","times":32.1', '"kind":"step","steps":1.5', '"kind":"step","steps":9007199254740992', '"kind":"play","playing":1',
        '"kind":"met","name":""', '"kind":"go_to","x_m":1,"y_m":100000.1', '"kind":"go_to","x_m":1,"y_m":1,"level":1000',
        '"kind":"met","name":"' + 33 * "x" + '"', '"kind":"drawn"', '"kind":"undo","undo":0', '"seq":1',
        '"kind":"call"', '"kind":"call","help":1', '"kind":"call","help":null',
    ],
)  # fmt: skip
def test_a_request_beyond_its_limits_is_none(text: str) -> None:
    assert requests.parse_request("{" + text + "}") is None


@pytest.mark.parametrize(
    ("text", "request_"),
    [
        ('"kind":"go_to","x_m":1,"y_m":2', requests.GoTo(1.0, 2.0, 0)), ('"kind":"step","steps":-3', requests.Step(-3)),
        ('"kind":"check_in","x_m":1,"y_m":2,"sd_m":0,"heading_rad":4', CheckIn(1.0, 2.0, 4.0 - 2.0 * math.pi, 0.05, 0)),
    ],
)  # fmt: skip
def test_a_request_within_its_limits(text: str, request_: requests.Request) -> None:
    assert requests.parse_request("{" + text + "}") == request_


@given(
    st.binary(max_size=600) | st.dictionaries(fields, json_like, max_size=6).map(lambda tree: json.dumps(tree).encode())
)
def test_no_chunk_of_a_person_breaks_the_tracker(payload: bytes) -> None:
    said = parse_person(payload)
    assert (
        said is None
        or isinstance(said, Undo | Call)
        or (math.isfinite(said.x_m + said.y_m + said.sd_m) and said.level >= 0)
    )


def test_a_check_in_comes_back_from_its_bytes() -> None:
    for said in (
        CheckIn(1.25, -3.5, None, 0.5),
        CheckIn(0.1, 0.2, 0.3, 0.4, 2),
        Undo(3),
        Call(help=True),
        Call(help=False),
    ):
        assert parse_person(said.encode()) == said


@pytest.mark.parametrize(
    "tree",
    [
        {"x_m": 1, "y_m": 2}, {"x_m": 1, "y_m": 2, "sd_m": "1"}, {"x_m": 1e9, "y_m": 2, "sd_m": 1}, {"x_m": True, "y_m": 2, "sd_m": 1},
        {"x_m": 1, "y_m": 2, "sd_m": 1, "heading_rad": "east"}, {"x_m": 1, "y_m": 2, "sd_m": 1, "level": -1},
        {"x_m": 1, "y_m": 2, "sd_m": 1, "level": 0.5}, [1], {"undo": 0}, {"undo": True}, {"undo": 1.0}, {"undo": 1 << 40},
        {"help": 1}, {"help": None}, {"help": "yes"},
    ],
)  # fmt: skip
def test_half_a_check_in_is_none(tree: object) -> None:
    assert parse_person(json.dumps(tree).encode()) is None


def with_check_ins(chunks: list[Chunk]) -> list[Chunk]:
    """Two check-ins, one of them on a level that there is not, and bytes that are none."""
    ends = [CheckIn(7.0, 7.5, 0.0, 0.3), CheckIn(9.5, 9.0, None, 0.5), CheckIn(1.0, 1.0, None, 0.5, 7)]
    payloads = [*(said.encode() for said in ends), b"\xff{"]
    mixed = list(chunks)
    for k, payload in enumerate(payloads):
        at = len(mixed) * (k + 2) // 8
        mixed.insert(at, Chunk(PERSON, mixed[at].t_arrival_ns, payload))
    return mixed


@pytest.mark.long
def test_check_ins_give_the_same_estimates_in_whatever_portions(chunks: list[Chunk]) -> None:
    mixed = with_check_ins(chunks[: len(chunks) // 2])
    one, many, start = Tracker(PLAN, Pose(2.0, 7.5, 0.0), seed=1), Tracker(PLAN, Pose(2.0, 7.5, 0.0), seed=1), 0
    singly = [estimate for chunk in mixed for estimate in one.feed(chunk)]
    jointly: list[Estimate] = []
    for size in itertools.cycle((1, 7, 400, 3000)):
        jointly += many.take(portion_of(mixed[start : start + size]))
        start += size
        if start >= len(mixed):
            break
    assert len(singly) > 3
    assert digest(singly) == digest(jointly)
    assert {(each.state.check_ins, each.state.bad_check_ins) for each in (one, many)} == {(2, 2)}
    assert one.front_end.counts.unknown_ports == 0


def test_a_check_in_draws_the_cloud_anew(chunks: list[Chunk]) -> None:
    tracker = Tracker(PLAN, Pose(2.0, 7.5, 0.0), seed=1)
    tracker.take(portion_of(chunks[: len(chunks) // 3]))
    (after,) = tracker.feed(Chunk(PERSON, 0, CheckIn(20.0, 2.0, 1.0, 0.5).encode()))
    assert math.hypot(after.x_m - 20.0, after.y_m - 2.0) < 0.2
    assert abs(after.heading_rad - 1.0) < 0.1
    assert 0.3 < math.sqrt(after.xx_m2) < 0.7


def test_a_check_in_without_heading_keeps_the_heading_that_is_known(chunks: list[Chunk]) -> None:
    tracker = Tracker(PLAN, Pose(2.0, 7.5, 0.0), seed=1)
    before = tracker.take(portion_of(chunks[: len(chunks) // 3]))[-1]
    (after,) = tracker.feed(Chunk(PERSON, 0, CheckIn(before.x_m, before.y_m, None, 0.3).encode()))
    assert abs(after.heading_rad - before.heading_rad) < 0.1


@pytest.mark.parametrize("start", [Pose(2.0, 7.5, 0.0), None], ids=["known start", "start by tap"])
def test_a_wrong_tap_that_is_undone_leaves_no_trace(chunks: list[Chunk], start: Pose | None) -> None:
    """The estimates after the undoing are those of a run that never was tapped, bit for bit; in whatever portions."""
    plan, early = replace(PLAN, start=None), [] if start else [Chunk(PERSON, 0, CheckIn(2.0, 7.5, 0.0, 0.3).encode())]
    clean = [*early, *chunks]
    at, back = len(clean) // 2, len(clean) * 5 // 8
    wrong = Chunk(PERSON, 0, CheckIn(20.0, 2.0, None, 0.2).encode())
    undo = Chunk(PERSON, 0, Undo(1 + len(early)).encode())
    tapped = [*clean[:at], wrong, *clean[at:back], undo, undo, *clean[back:]]
    never, once = (Tracker(plan, start, seed=1, waits=True) for _ in range(2))
    assert never.state.waits_for_start == (start is None)
    never.take(portion_of(clean[:back]))
    expected = never.take(portion_of(clean[back:]))
    once.take(portion_of(tapped[: at + 1]))
    assert once.state.undoable == 1 + len(early)
    shown = [e for k in range(at + 1, len(tapped), 100) for e in once.take(portion_of(tapped[k : k + 100]))]
    assert len(expected) > 4
    assert digest(shown[-len(expected) :]) == digest(expected)
    assert (once.state.undone, once.state.bad_check_ins) == (1, 1)
    assert once.state.undoable is None
    assert shown[0].x_m > 19.0
    assert math.hypot(shown[-1].x_m - 9.5, shown[-1].y_m - 10.8) < 0.5


@pytest.mark.long
def test_who_watches_changes_nothing(chunks: list[Chunk]) -> None:
    alone, watched = (Tracker(PLAN, Pose(2.0, 7.5, 0.0), seed=1) for _ in range(2))
    expected = alone.take(portion_of(chunks))
    found = []
    with LivePage(watched, "test", LOCAL) as page:
        for chunk in chunks:
            portion = portion_of([chunk])
            page.note_arrival()
            found += watched.take(portion)
            page.publish(portion)
        with opened_url(page.url) as looking:
            assert json.loads(looking.recv(timeout=PATIENCE_S))["kind"] == "hello"
            frame = next_frame(looking)
    assert digest(found) == digest(expected)
    assert frame["told"]["x_m"] == expected[-1].x_m
    health = frame["streams"]
    assert abs(health["mtx_hz"] - 100.0) < 3.0
    assert 25.0 < health["pings_hz"] < 33.0
    assert health["lost"] == 0


@pytest.mark.parametrize(("at", "fits"), [((0.0, 0.0), True), ((14.0, 4.0), False)])
def test_echoes_speak_for_a_right_tap_and_against_a_wrong_one(
    scenario: Scenario, chunks: list[Chunk], at: tuple[float, float], fits: bool
) -> None:
    """The wearer walks in the corridor, where echoes tell nothing until the next door; the wrong tap is in Office 4."""
    tracker, begin = Tracker(PLAN, Pose(2.0, 7.5, 0.0), seed=1), len(chunks) * 2 // 5
    tracker.take(portion_of(chunks[:begin]))
    tap_s = 1e-9 * (chunks[begin].t_arrival_ns - START_NS)
    _, x_m, y_m, *_ = scenario.truth[np.searchsorted(scenario.truth[:, 0], tap_s)]
    tracker.feed(Chunk(PERSON, 0, CheckIn(x_m + at[0], y_m + at[1], None, 0.2).encode()))
    for k in range(begin, len(chunks), 100):
        tracker.take(portion_of(chunks[k : k + 100]))
        if not PROBABLE <= tracker.state.right <= BELIEVED:
            break
    assert (tracker.state.right > BELIEVED) == fits
    assert (tracker.state.right < PROBABLE) == (not fits)
