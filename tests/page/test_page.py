"""The page's server: hostile sockets, slow pages, check-ins that replay bit for bit."""

from __future__ import annotations

import contextlib
import itertools
import json
import math
import socket
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin

from board_runs import ROOT
from echostep.errors import EchostepError
from echostep.localization.estimate import Estimate, TrackStatus, digest
from echostep.page import protocol
from echostep.page.elements.echo_lines import EchoLine
from echostep.page.elements.guidance import Destination, RouteFinder, straight_line
from echostep.page.elements.lookahead import extrapolate
from echostep.page.elements.scene import PageScene, ParticleSample, status_text
from echostep.page.live import LivePage
from echostep.page.mailbox import MOST_CHECK_INS, Mailbox, SceneHistory
from echostep.page.replay_cursor import ReplayCursor
from echostep.page.server import MOST_PAGES, Address, PageServer
from echostep.page.session import MOST_UNDRAWN
from echostep.plan.model import Pose, load_plan
from echostep.plan.routing import RoutePlace
from echostep.ports.check_in import PERSON, CheckIn, parse_check_in
from echostep.ports.chunks import Chunk, portion_of
from echostep.simulation.devices.board import PythonBoard
from echostep.simulation.scenario import Scenario
from echostep.tracker import Tracker

PLAN = load_plan(ROOT / "host/echostep/plans/demo.json")
LOCAL = Address(port=0)
json_like = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=6,
)
fields = st.sampled_from(["x_m", "y_m", "sd_m", "heading_rad", "level", "seq", "playing", "times", "t_s", "by"])
kinds = st.sampled_from(["check_in", "go_to", "go_nowhere", "drawn", "play", "speed", "seek", "skip", "?"])


@pytest.fixture(scope="module")
def chunks() -> list[Chunk]:
    scenario = Scenario(PLAN, ((2.0, 7.5), (9.5, 7.5), (9.5, 10.8)), 5, PythonBoard(seed=5))
    return list(scenario.chunks())


def told(
    x_m: float = 2.0, y_m: float = 7.5, t_s: float = 1.0, status: TrackStatus = TrackStatus.TRACKING, sd_m: float = 0.1
) -> Estimate:
    return Estimate(t_s, x_m, y_m, sd_m**2, 0.0, sd_m**2, 0.0, 0.02, 1, status)


def scene(t_s: float = 1.0, trail_count: int = 0, particles: int = 300) -> PageScene:
    x = np.linspace(1.0, 3.0, particles, dtype=np.float32)
    cloud = ParticleSample(x, x + 5.0, np.full(particles, 200, np.uint8), np.zeros(particles, np.uint8))
    return PageScene(
        time.monotonic_ns(),
        t_s,
        told(t_s=t_s),
        cloud,
        (EchoLine(t_s, 0, 2.0, 7.5, 1.6, 1.0, None),),
        None,
        trail_count,
        "",
    )


@contextlib.contextmanager
def served(mailbox: Mailbox | None = None) -> Iterator[tuple[PageServer, Mailbox]]:
    mailbox = mailbox or Mailbox(PLAN, "test", replay=False)
    with PageServer(mailbox, LOCAL) as server:
        yield server, mailbox


def opened(server: PageServer) -> ClientConnection:
    return opened_url(server.url)


def opened_url(url: str) -> ClientConnection:
    return connect(f"ws{url[4:]}socket", origin=Origin("/".join(url.split("/")[:3])), max_size=None)


def header(received: str | bytes) -> dict[str, Any]:
    assert isinstance(received, bytes)
    length = int.from_bytes(received[:4], "little")
    return dict(json.loads(received[4 : 4 + length]))


def next_frame(page: ClientConnection) -> dict[str, Any]:
    return header(page.recv(timeout=5))


@given(kinds, st.dictionaries(fields, json_like, max_size=6))
def test_no_request_breaks_the_parser(kind: str, rest: dict[str, object]) -> None:
    protocol.parse_request(json.dumps({"kind": kind, **rest}))


@given(st.text() | st.just("[" * 2000) | st.just("9" * 2000) | json_like.map(json.dumps))
def test_no_text_breaks_the_parser(text: str) -> None:
    assert protocol.parse_request(text) is None or '"kind"' in text


@given(
    st.binary(max_size=600) | st.dictionaries(fields, json_like, max_size=6).map(lambda tree: json.dumps(tree).encode())
)
def test_no_chunk_of_a_person_breaks_the_tracker(payload: bytes) -> None:
    said = parse_check_in(payload)
    assert said is None or (math.isfinite(said.x_m + said.y_m + said.sd_m) and said.level >= 0)


def test_a_check_in_comes_back_from_its_bytes() -> None:
    for said in (CheckIn(1.25, -3.5, None, 0.5), CheckIn(0.1, 0.2, 0.3, 0.4, 2)):
        assert parse_check_in(said.encode()) == said


@pytest.mark.parametrize(
    "tree",
    [
        {"x_m": 1, "y_m": 2}, {"x_m": 1, "y_m": 2, "sd_m": "1"}, {"x_m": 1e9, "y_m": 2, "sd_m": 1}, {"x_m": True, "y_m": 2, "sd_m": 1},
        {"x_m": 1, "y_m": 2, "sd_m": 1, "heading_rad": "east"}, {"x_m": 1, "y_m": 2, "sd_m": 1, "level": -1},
        {"x_m": 1, "y_m": 2, "sd_m": 1, "level": 0.5}, [1],
    ],
)  # fmt: skip
def test_half_a_check_in_is_none(tree: object) -> None:
    assert parse_check_in(json.dumps(tree).encode()) is None


def with_check_ins(chunks: list[Chunk]) -> list[Chunk]:
    """Two check-ins, one of them on a level that there is not, and bytes that are none."""
    ends = [CheckIn(7.0, 7.5, 0.0, 0.3), CheckIn(9.5, 9.0, None, 0.5), CheckIn(1.0, 1.0, None, 0.5, 7)]
    payloads = [*(said.encode() for said in ends), b"\xff{"]
    mixed = list(chunks)
    for k, payload in enumerate(payloads):
        at = len(mixed) * (k + 2) // 8
        mixed.insert(at, Chunk(PERSON, mixed[at].t_arrival_ns, payload))
    return mixed


def test_check_ins_give_the_same_estimates_in_whatever_portions(chunks: list[Chunk]) -> None:
    mixed = with_check_ins(chunks)
    one, many, start = Tracker(PLAN, Pose(2.0, 7.5, 0.0), seed=1), Tracker(PLAN, Pose(2.0, 7.5, 0.0), seed=1), 0
    singly = [estimate for chunk in mixed for estimate in one.feed(chunk)]
    jointly: list[Estimate] = []
    for size in itertools.cycle((1, 7, 400, 3000)):
        jointly += many.take(portion_of(mixed[start : start + size]))
        start += size
        if start >= len(mixed):
            break
    assert digest(singly) == digest(jointly)
    assert (one.state.check_ins, one.state.bad_check_ins, many.state.check_ins, many.state.bad_check_ins) == (
        2,
        2,
        2,
        2,
    )
    assert one.front_end.counts.unknown_ports == 0


def test_a_check_in_draws_the_cloud_anew(chunks: list[Chunk]) -> None:
    tracker = Tracker(PLAN, Pose(2.0, 7.5, 0.0), seed=1)
    for chunk in chunks[: len(chunks) // 3]:
        tracker.feed(chunk)
    (after,) = tracker.feed(Chunk(PERSON, 0, CheckIn(20.0, 2.0, 1.0, 0.5).encode()))
    assert math.hypot(after.x_m - 20.0, after.y_m - 2.0) < 0.2
    assert abs(after.heading_rad - 1.0) < 0.1
    assert 0.3 < math.sqrt(after.xx_m2) < 0.7


def test_a_check_in_without_heading_keeps_the_heading_that_is_known(chunks: list[Chunk]) -> None:
    tracker = Tracker(PLAN, Pose(2.0, 7.5, 0.0), seed=1)
    before = [estimate for chunk in chunks[: len(chunks) // 3] for estimate in tracker.feed(chunk)][-1]
    (after,) = tracker.feed(Chunk(PERSON, 0, CheckIn(before.x_m, before.y_m, None, 0.3).encode()))
    assert abs(after.heading_rad - before.heading_rad) < 0.1


@pytest.mark.parametrize("heading_rad", [0.0, None])
def test_a_tap_starts_the_walk_where_nobody_knew(chunks: list[Chunk], heading_rad: float | None) -> None:
    nowhere = replace(PLAN, start=None)
    with pytest.raises(EchostepError, match="--start"):
        Tracker(nowhere)
    tracker = Tracker(nowhere, seed=1, waits=True)
    assert tracker.state.waits_for_start
    early = [estimate for chunk in chunks[:400] for estimate in tracker.feed(chunk)]
    tracker.feed(Chunk(PERSON, 0, CheckIn(2.0, 7.5, heading_rad, 0.5).encode()))
    late = [estimate for chunk in chunks[400:] for estimate in tracker.feed(chunk)]
    assert not early
    assert not tracker.state.waits_for_start
    assert math.hypot(late[-1].x_m - 9.5, late[-1].y_m - 10.8) < 1.0


def test_who_watches_changes_nothing(chunks: list[Chunk]) -> None:
    alone, watched = (Tracker(PLAN, Pose(2.0, 7.5, 0.0), seed=1) for _ in range(2))
    expected = [estimate for chunk in chunks for estimate in alone.feed(chunk)]
    found = []
    with LivePage(watched, "test", LOCAL) as page:
        for chunk in chunks:
            portion = portion_of([chunk])
            page.note_arrival()
            found += watched.take(portion)
            page.publish(portion)
        with opened_url(page.url) as looking:
            assert json.loads(looking.recv(timeout=5))["kind"] == "hello"
            frame = next_frame(looking)
    assert digest(found) == digest(expected)
    assert frame["told"]["x_m"] == expected[-1].x_m
    health = frame["streams"]
    assert abs(health["mtx_hz"] - 100.0) < 3.0
    assert 25.0 < health["pings_hz"] < 33.0
    assert health["lost"] == 0


def test_without_bytes_the_page_says_lost(chunks: list[Chunk]) -> None:
    tracker = Tracker(PLAN, Pose(2.0, 7.5, 0.0), seed=1)
    with LivePage(tracker, "test", LOCAL) as page, opened_url(page.url) as looking:
        begin_ns = time.monotonic_ns() - chunks[-1].t_arrival_ns
        for chunk in [
            *(replace(chunk, t_arrival_ns=chunk.t_arrival_ns + begin_ns - 3_000_000_000) for chunk in chunks),
            None,
        ]:
            portion = portion_of([chunk] if chunk else [])
            tracker.take(portion)
            page.publish(portion)
        looking.recv(timeout=5)
        frame = next_frame(looking)
        while not frame["words"].startswith("lost"):
            looking.send(json.dumps({"kind": "drawn", "seq": frame["seq"]}))
            frame = next_frame(looking)
    assert frame["words"].startswith("lost: nothing from the foot for ")
    assert frame["told"]["status"] == "lost"
    assert not frame["told"]["heading_known"]
    assert frame["told"]["major_m"] > 5.0


def test_a_page_gets_plan_walls_and_frames() -> None:
    with served() as (server, mailbox):
        mailbox.trail.add(1.0, 2.0, 0)
        mailbox.publish(scene(trail_count=1))
        with opened(server) as page:
            hello = json.loads(page.recv(timeout=5))
            frame = next_frame(page)
        walls = urllib.request.urlopen(f"{server.url}walls/0", timeout=5).read()
    assert hello["plan"]["levels"][0]["rooms"][0]["name"] == "Office 1"
    assert np.array_equal(np.frombuffer(walls, "<f4").reshape(-1, 4), PLAN.levels[0].solid.astype("<f4"))
    assert frame["trail"] == {"from": 0, "count": 1}
    assert frame["cloud"]["count"] == 300


def test_the_cloud_is_quantised_to_a_millimetre() -> None:
    rng = np.random.default_rng(0)
    x, y = (rng.uniform(-20.0, 20.0, 999).astype(np.float32) for _ in range(2))
    sent = protocol.frame(
        replace(scene(), particles=None),
        1,
        b"",
        0,
        ParticleSample(x, y, np.zeros(999, np.uint8), np.zeros(999, np.uint8)),
        None,
        None,
    )
    head = header(sent)["cloud"]
    at = 4 + int.from_bytes(sent[:4], "little")
    for column, k, origin in ((x, 0, "x0_m"), (y, 1, "y0_m")):
        back = head[origin] + head["step_m"] * np.frombuffer(sent, "<u2", 999, at + 2 * 999 * k)
        assert np.abs(back - column).max() < 1e-3


def test_a_page_that_sleeps_is_sent_nothing_and_catches_up() -> None:
    with served() as (server, mailbox):
        mailbox.publish(scene(0.0))
        with opened(server) as page:
            page.recv(timeout=5)
            serials = [next_frame(page)["seq"]]
            for k in range(100):
                mailbox.trail.add(float(k), 0.0, 0)
                mailbox.publish(scene(float(k), trail_count=k + 1))
                time.sleep(0.002)
            with contextlib.suppress(TimeoutError):
                while True:
                    serials.append(header(page.recv(timeout=0.3))["seq"])
            assert len(serials) == MOST_UNDRAWN
            for serial in serials:
                page.send(json.dumps({"kind": "drawn", "seq": serial}))
            frame = next_frame(page)
    assert frame["t_s"] == 99.0
    trail = frame["trail"]
    assert trail["from"] + trail["count"] == 100


def test_the_tracker_never_waits_for_ten_pages_that_are_stuck() -> None:
    with served() as (server, mailbox), contextlib.ExitStack() as stack:
        for _ in range(10):
            stack.enter_context(opened(server))
        longest_s = 0.0
        for k in range(300):
            began = time.perf_counter()
            mailbox.publish(scene(float(k), particles=10_000))
            longest_s = max(longest_s, time.perf_counter() - began)
            time.sleep(0.001)
        assert server.pages == 10
    assert longest_s < 0.05  # making the scene of 10,000 is in it


@pytest.mark.parametrize(
    ("origin", "host"),
    [
        ("http://evil.example", None),
        ("null", None),
        ("", None),
        (None, "evil.example"),
        ("http://evil.example:80", "evil.example:80"),
    ],
)
def test_another_site_is_refused(origin: str | None, host: str | None) -> None:
    with served() as (server, _):
        own = server.url.rstrip("/")
        with pytest.raises((InvalidStatus, ConnectionClosed)):
            connect_as(server, own if origin is None else origin, host).recv(timeout=5)
        assert server.access_control.refused == 1
        assert server.pages == 0


def connect_as(server: PageServer, origin: str, host: str | None) -> ClientConnection:
    headers = {"Origin": origin} if origin else {}
    if host is None:
        return connect(f"ws{server.url[4:]}socket", additional_headers=headers, origin=None)
    name, port = server.url[7:].rstrip("/").split(":")
    return connect(f"ws://{host}/socket", additional_headers=headers, sock=socket.create_connection((name, int(port))))


def test_without_the_token_nothing_answers() -> None:
    with PageServer(Mailbox(PLAN, "test", replay=False), Address("0.0.0.0", 0)) as server:
        port, token = server.url.split(":")[2].split("/")[:2]
        local = f"http://127.0.0.1:{port}"
        assert len(token) >= 20
        for path in ("", "static/main.js", "walls/0", f"{token[:-1]}/", "../"):
            with pytest.raises(urllib.error.HTTPError) as refused:
                urllib.request.urlopen(f"{local}/{path}", timeout=5)
            assert refused.value.code == 404
        with pytest.raises(InvalidStatus):
            connect(f"ws{local[4:]}/socket", origin=Origin(local))
        page = urllib.request.urlopen(f"{local}/{token}/", timeout=5)
        assert b"echostep" in page.read()
        assert "script-src 'self'" in page.headers["content-security-policy"]
        with connect(f"ws{local[4:]}/{token}/socket", origin=Origin(local)) as page_socket:
            assert json.loads(page_socket.recv(timeout=5))["kind"] == "hello"


def test_noise_is_counted_and_the_page_goes_on() -> None:
    with served() as (server, mailbox):
        mailbox.publish(scene())
        with opened(server) as page:
            noise: list[str | bytes] = [
                "",
                "{",
                "[]",
                "null",
                '{"kind":"sudo"}',
                '{"kind":["x"]}',
                '{"kind":"go_to","x_m":1e999}',
                b"\x00\xff",
            ]
            for sent in noise:
                page.send(sent)
            page.send('{"kind":"go_to","x_m":5,"y_m":7.5}')
            deadline = time.monotonic() + 5
            page.recv(timeout=5)
            frame = next_frame(page)
            page.send(json.dumps({"kind": "drawn", "seq": frame["seq"]}))
            while frame["guidance"] is None and time.monotonic() < deadline:
                frame = next_frame(page)
        assert frame["guidance"]["left_m"] == pytest.approx(3.0)
        assert server.counts.unknown == len(noise)


def test_too_long_or_too_many_messages_end_the_socket_alone() -> None:
    with served() as (server, mailbox):
        mailbox.publish(scene())
        for message, count in (("x" * 5000, 1), ("{}", 1000)):
            with opened(server) as page, pytest.raises(ConnectionClosed):
                send_and_listen(page, message, count)
        assert server.counts.flooding == 1
        with opened(server) as page:
            assert json.loads(page.recv(timeout=5))["kind"] == "hello"


def send_and_listen(page: ClientConnection, message: str, count: int) -> None:
    for _ in range(count):
        page.send(message)
    for _ in range(5):
        page.recv(timeout=5)


def test_so_many_pages_and_no_more() -> None:
    with served() as (server, _), contextlib.ExitStack() as stack:
        for _ in range(MOST_PAGES):
            stack.enter_context(opened(server)).recv(timeout=5)
        with opened(server) as late, pytest.raises(ConnectionClosed):
            late.recv(timeout=5)
        assert server.pages == MOST_PAGES


def test_check_ins_that_nobody_takes_are_refused() -> None:
    said = '{"kind":"check_in","x_m":1,"y_m":2,"heading_rad":null,"sd_m":0.5}'
    with served() as (server, mailbox), opened(server) as page:
        page.recv(timeout=5)
        for _ in range(MOST_CHECK_INS + 1):
            page.send(said)
        assert json.loads(page.recv(timeout=5)) == {"kind": "refused", "what": "check_in"}
        assert list(mailbox.pop_check_ins()) == [CheckIn(1.0, 2.0, None, 0.5)] * MOST_CHECK_INS
    with served(Mailbox(PLAN, "a replay", replay=True)) as (server, mailbox), opened(server) as page:
        assert json.loads(page.recv(timeout=5))["replay"]
        page.send(said)
        assert json.loads(page.recv(timeout=5))["kind"] == "refused"
        assert not list(mailbox.pop_check_ins())


def test_an_address_that_is_taken_is_named_or_another_is_found() -> None:
    with served() as (server, _):
        port = int(server.url.rstrip("/").rsplit(":", 1)[1])
        with pytest.raises(EchostepError, match=f"--port {port}"):
            PageServer(Mailbox(PLAN, "test", replay=False), Address(port=port))
    with pytest.raises(EchostepError, match="no-such-host"):
        PageServer(Mailbox(PLAN, "test", replay=False), Address("no-such-host.invalid", 0))


def test_a_cursor_plays_stops_seeks_and_steps() -> None:
    history = SceneHistory()
    cursor = ReplayCursor(history)
    assert cursor.scene(100.0) is None
    for t_s in (10.0, 11.0, 12.0, 13.0):
        history.add(scene(t_s))

    def at(now_s: float) -> float:
        shown = cursor.scene(now_s)
        assert shown is not None
        return shown.t_s

    assert at(100.0) == 10.0
    assert at(101.5) == 11.0
    cursor.handle(protocol.SetSpeed(4.0))
    assert at(101.9) == 13.0
    assert at(500.0) == 13.0
    cursor.handle(protocol.StepBy(-2))
    assert (at(501.0), cursor.playing) == (11.0, False)
    assert at(502.0) == 11.0
    cursor.handle(protocol.Seek(12.4))
    assert at(503.0) == 12.0
    cursor.handle(protocol.Seek(1e9))
    assert at(504.0) == 13.0
    cursor.handle(protocol.SetPlaying(True))  # at the end: from the beginning
    assert at(504.0) == 10.0


def test_status_in_words() -> None:
    assert status_text(told()) == "tracking, 0.2 m"
    assert status_text(told(sd_m=1.2, status=TrackStatus.UNCERTAIN)) == "uncertain, 3 m"
    assert status_text(told(status=TrackStatus.LOST)) == "lost: walk along a wall or tap where you are"
    assert status_text(None, needs_start=True) == "tap where you stand to start"


def test_an_errand_finds_its_way_around_walls() -> None:
    destination, here, goal = Destination(RoutePlace(13.0, 4.5)), told(9.0, 7.5), RoutePlace(13.0, 4.5)
    assert "straight line" in destination.guidance_at(here).text
    assert destination.needs_route(here)
    destination.set_route(RouteFinder(PLAN).find(here, goal), "", here)
    way = destination.guidance_at(here)
    assert not destination.needs_route(here)
    assert (way.left_m or 0.0) > 5.5  # through the door at (13, 6.5)
    assert way.path[-1] == (13.0, 4.5)
    assert abs(way.arrow_rad or 0.0) < 0.3
    with pytest.raises(EchostepError) as outside:
        RouteFinder(PLAN).find(here, RoutePlace(500.0, 500.0))
    destination.set_route(None, str(outside.value), here)
    assert "outside the plan" in destination.guidance_at(here).text
    assert not destination.needs_route(here)
    assert destination.needs_route(told(9.0, 7.5, t_s=10.0))


def test_a_step_leads_ahead_of_its_echoes(chunks: list[Chunk]) -> None:
    tracker = Tracker(PLAN, Pose(2.0, 7.5, 0.0), seed=1)
    off_m, last, then = [], None, None
    for chunk in chunks:
        new = tracker.feed(chunk)
        if new and then:
            off_m.append(math.hypot(new[0].x_m - then.x_m, new[0].y_m - then.y_m))
            assert new[0].t_s == then.t_s
        if new:
            last, then = new[-1], None
        if last and (since := tracker.state.pending_segments) and tracker.state.last_segment and not then:
            then = extrapolate(last, tracker.state.last_segment, since[:1])
            assert then.xx_m2 > last.xx_m2
    assert len(off_m) > 5
    assert max(off_m) < 0.3
    assert np.median(off_m) < 0.1


def test_guidance_points_and_arrives() -> None:
    way = straight_line(told(), RoutePlace(2.0, 17.5, 0))
    assert (way.left_m or 0.0) == 10.0
    assert way.arrow_rad == pytest.approx(math.pi / 2)
    assert straight_line(told(), RoutePlace(2.3, 7.5, 0)).text == "You have arrived"
    assert "1 floor up" in straight_line(told(), RoutePlace(2.3, 7.5, 1)).text
    looks_north = replace(told(), heading_rad=math.pi / 2)
    assert straight_line(looks_north, RoutePlace(2.0, 17.5, 0)).arrow_rad == pytest.approx(0.0)
    unknown = straight_line(replace(told(), heading_sd_rad=2.0), RoutePlace(2.0, 17.5, 0))
    assert (unknown.kind, unknown.arrow_rad) == ("stop", None)
