# SPDX-License-Identifier: MIT
"""The live server by a WebSocket client of the tests' own: what is advertised, what comes, who can connect."""

from __future__ import annotations

import json
import socket
import struct
import subprocess
import threading
import time
from collections import deque
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

from command_line import PROGRAM
from echostep.errors import EchostepError
from echostep.plan import Georeference
from echostep.ports.chunks import portion_of
from echostep.recording import utc_offset_ns
from echostep.tracker import Tracker
from echostep_app.output.derived import Derived
from echostep_app.output.foxglove import LOCATION, SCENE
from echostep_app.output.foxglove_live import ALL_TOPICS, FoxgloveAddress, FoxgloveServer, parse_address
from echostep_app.recording.recorder import DerivedMessage
from free_ports import free_port
from recording.damages import write_recording
from waiting import PATIENCE_S, until
from walks import DEMO, PLAN, walk_chunks

PROTOCOL = Subprotocol("foxglove.sdk.v1")
MESSAGE = 0x01  # opcode of a binary message: subscription u32, time u64 in ns, payload [Foxglove, ws-protocol]


class Viewer:
    """Subscribes to topics and keeps what comes."""

    def __init__(self, url: str, topics: set[str]) -> None:
        self.channels: dict[str, Any] = {}
        self.messages: list[tuple[str, int, dict[str, Any]]] = []
        self._topics = topics
        self._socket: ClientConnection | None = None
        self._thread = threading.Thread(target=self._listen, args=(url,), daemon=True)
        self._thread.start()

    def _listen(self, url: str) -> None:
        with connect(url, subprotocols=[PROTOCOL], max_size=None) as self._socket, suppress(ConnectionClosed):
            self._read(self._socket)

    def _read(self, opened: ClientConnection) -> None:
        names: dict[int, str] = {}
        for frame in opened:
            if isinstance(frame, bytes):
                kind, subscription, t_ns = struct.unpack_from("<BIQ", frame)
                if kind == MESSAGE:
                    self.messages.append((names[subscription], t_ns, json.loads(frame[13:])))
                continue
            told = json.loads(frame)
            if told["op"] == "advertise":
                new = [channel for channel in told["channels"] if channel["topic"] in self._topics]
                names |= {channel["id"]: channel["topic"] for channel in new}
                wanted = [{"id": channel["id"], "channelId": channel["id"]} for channel in new]
                opened.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))
                self.channels |= {channel["topic"]: channel for channel in told["channels"]}

    def of(self, topic: str) -> list[dict[str, Any]]:
        """Bodies of a topic's messages."""
        return [body for name, _, body in self.messages if name == topic]

    def close(self) -> None:
        until(lambda: self._socket is not None)
        assert self._socket is not None
        self._socket.close()
        self._thread.join(PATIENCE_S)


@contextmanager
def viewing(url: str, topics: set[str]) -> Iterator[Viewer]:
    viewer = Viewer(url, topics)
    try:
        yield viewer
    finally:
        viewer.close()


@pytest.fixture(scope="module")
def derived() -> list[DerivedMessage]:
    """The messages of a walk on a plan by the Tay."""
    tracker = Tracker(replace(PLAN, georeference=Georeference(-2.978, 56.46, 0.5)), seed=1)
    maker, chunks = Derived(tracker), walk_chunks()
    portions = [portion_of(chunks[k : k + 50]) for k in range(0, len(chunks), 50)]
    return [message for portion in portions for message in maker.take(portion, tracker.take(portion))]


def settled(server: FoxgloveServer, viewer: Viewer, topic: str, probe: DerivedMessage) -> None:
    """Until the subscription is at work: what was sent before is not delivered."""

    def heard() -> bool:
        server.write([probe])
        return bool(viewer.of(topic))

    until(heard)


def test_every_topic_is_advertised_with_the_recording_s_schema() -> None:
    with FoxgloveServer(FoxgloveAddress("127.0.0.1", 0), "a test") as server, viewing(server.url, set()) as viewer:
        until(lambda: len(viewer.channels) == len(ALL_TOPICS))
        for topic in ALL_TOPICS:
            channel = viewer.channels[topic.name]
            assert (channel["encoding"], channel["schemaName"]) == ("json", topic.schema_name)
            assert json.loads(channel["schema"]) == json.loads(topic.schema)


@pytest.mark.slow
def test_messages_arrive_as_they_are_recorded(derived: list[DerivedMessage]) -> None:
    """Every message of a walk, with its time; all by their schemas."""
    topics = {"/estimate", "/echo/left", "/location"}
    expected = [(m.topic.name, m.t_ns, json.loads(json.dumps(m.body))) for m in derived if m.topic.name in topics][:200]
    with FoxgloveServer(FoxgloveAddress("127.0.0.1", 0), "a test") as server, viewing(server.url, topics) as viewer:
        probe = next(m for m in derived if m.topic is LOCATION)
        settled(server, viewer, LOCATION.name, probe)
        begin = len(viewer.messages)
        for message in [m for m in derived if m.topic.name in topics][:200]:
            server.write([message])
        assert until(lambda: viewer.messages[-1] == expected[-1])  # probes may come between
        came = [m for m in viewer.messages[begin:] if m[1] != probe.t_ns or m[0] != LOCATION.name]
        assert came == [m for m in expected if m[1] != probe.t_ns or m[0] != LOCATION.name]
        for name, _, body in came:
            jsonschema.validate(body, json.loads(viewer.channels[name]["schema"]))


def test_a_late_viewer_gets_plan_and_track(derived: list[DerivedMessage]) -> None:
    scenes = [m for m in derived if m.topic is SCENE]
    with FoxgloveServer(FoxgloveAddress("127.0.0.1", 0), "a test") as server:
        server.write(derived)
        with viewing(server.url, {SCENE.name}) as viewer:
            settled(server, viewer, SCENE.name, scenes[-1])
            until(lambda: any("plan 0 Ground floor" in names(body) for body in viewer.of(SCENE.name)))
            whole = next(body for body in viewer.of(SCENE.name) if "plan 0 Ground floor" in names(body))
    assert {"track_0", "ellipse95", "echo_left", "echo_right"} < names(whole)
    assert len(whole["entities"]) == len(names(whole))


def names(scene: dict[str, Any]) -> set[str]:
    return {entity["id"] for entity in scene["entities"]}


def test_only_this_computer_is_served_unless_a_host_is_given() -> None:
    assert parse_address("8765") == FoxgloveAddress("127.0.0.1", 8765)
    assert parse_address("0.0.0.0:8765") == FoxgloveAddress("0.0.0.0", 8765)
    assert parse_address("[::1]:0") == FoxgloveAddress("::1", 0)
    with FoxgloveServer(parse_address("0"), "a test") as server:
        port = int(server.url.rpartition(":")[2])
        with socket.socket() as other, pytest.raises(OSError, match="refused"):
            other.connect(("127.0.0.2", port))


def test_a_viewer_that_stalls_holds_up_neither_the_run_nor_the_others() -> None:
    pad = 20_000 * "x"
    with ExitStack() as opened:
        with FoxgloveServer(FoxgloveAddress("127.0.0.1", 0), "a test") as server:
            stalled = opened.enter_context(connect(server.url, subprotocols=[PROTOCOL], max_queue=1))
            stalled.recv(PATIENCE_S)
            channels = json.loads(stalled.recv(PATIENCE_S))["channels"]
            wanted = [{"id": channel["id"], "channelId": channel["id"]} for channel in channels]
            stalled.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))
            viewers = [opened.enter_context(viewing(server.url, {LOCATION.name})) for _ in range(2)]
            for viewer in viewers:
                settled(server, viewer, LOCATION.name, DerivedMessage(LOCATION, 0, {}))
            begin_s = time.monotonic()
            for k in range(1, 2001):
                server.write([DerivedMessage(LOCATION, k, {"pad": pad})])
            assert time.monotonic() - begin_s < PATIENCE_S
            assert until(lambda: all(viewer.messages[-1][1] == 2000 for viewer in viewers))
            end_s = time.monotonic()
        assert time.monotonic() - end_s < PATIENCE_S
        stalled.socket.close()


def test_the_server_ends_while_viewers_are_connected() -> None:
    """A viewer is told the end; one that has not finished its request delays nothing."""
    with ExitStack() as opened:
        server = FoxgloveServer(FoxgloveAddress("127.0.0.1", 0), "a test")
        with server:
            viewer = opened.enter_context(connect(server.url, subprotocols=[PROTOCOL]))
            opened.enter_context(socket.create_connection(("127.0.0.1", int(server.url.rpartition(":")[2]))))
            viewer.recv(PATIENCE_S)
        deque(viewer, maxlen=0)  # raises ConnectionClosedError for an end without a closing frame


@pytest.mark.parametrize("text", ["", "x", "host:", "1:70000", "8765x", "-1"])
def test_what_is_no_address_is_named(text: str) -> None:
    with pytest.raises(EchostepError, match="expected a port"):
        parse_address(text)


def test_a_port_in_use_is_one_line() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(EchostepError, match=f"--foxglove 127.0.0.1:{port}: cannot listen there"):
            FoxgloveServer(FoxgloveAddress("127.0.0.1", port), "a test")


@pytest.mark.long
@pytest.mark.process
def test_a_replay_is_seen_by_a_viewer(tmp_path: Path) -> None:
    """`replay --foxglove` sends the walk at the pace at which it was walked, with the times of day of the recording."""
    clock = {"started_utc": "2026-11-26T10:00:00.000+00:00", "started_ns": "0"}
    began_ns = utc_offset_ns(clock)
    assert began_ns
    write_recording(tmp_path / "walk.mcap", walk_chunks(5.0), {"seed": "3"} | clock)
    port = free_port()
    arguments = (
        "replay", tmp_path / "walk.mcap", "--plan", DEMO, "--headless", "--foxglove", port, "--start", "2,7.5,0", "--out", tmp_path,
    )  # fmt: skip
    with subprocess.Popen([*PROGRAM, *map(str, arguments)], stdout=subprocess.PIPE, text=True) as running:
        assert until(lambda: _listens(port) or running.poll() is not None)
        assert running.poll() is None
        with viewing(f"ws://127.0.0.1:{port}", {"/estimate", SCENE.name}) as viewer:
            printed, _ = running.communicate(timeout=PATIENCE_S)
            times = {t_ns for name, t_ns, _ in viewer.messages if name == "/estimate"}
            assert times
            assert all(began_ns < t_ns < began_ns + 10**10 for t_ns in times)
            assert any("plan 0 Ground floor" in names(body) for body in viewer.of(SCENE.name))
    assert running.returncode == 0, printed
    assert f"Foxglove WebSocket, ws://127.0.0.1:{port}" in printed


def _listens(port: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0
