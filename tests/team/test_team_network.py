"""Reports on real sockets: a Mosquitto broker that dies and returns, TLS, datagrams and streams of Cursor on Target."""

from __future__ import annotations

import json
import random
import socket
import ssl
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import paho.mqtt.client as paho
import pytest
from paho.mqtt.enums import CallbackAPIVersion

from echostep.cli import app
from echostep.errors import EchostepError
from echostep.team import outbox
from echostep.team.commander import update_roster
from echostep.team.cot import StreamTransport, UdpTransport
from echostep.team.endpoint import parse_endpoint
from echostep.team.inbox import Inbox, Receiver
from echostep.team.mqtt import Listener, MqttTransport
from echostep.team.outbox import Outbox
from echostep.team.report import Presence, Report, encode
from echostep.team.roster import Member, MemberState, Roster
from team.team_broker import Broker, Certificates, needs_broker
from team.team_reports import PLAN, POSITION, report

ECHOSTEP = [sys.executable, "-m", "echostep"]


@pytest.fixture(scope="module")
def certificates(tmp_path_factory: pytest.TempPathFactory) -> Certificates:
    return Certificates(tmp_path_factory.mktemp("certificates"))


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(outbox, "RETRY_PAUSES_S", (0.05, 0.1, 0.2))


def until(true: Callable[[], object], seconds: float = 15.0) -> None:
    end_s = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < end_s, "waited in vain"
        time.sleep(0.01)


def at(t_s: float, name: str = "anna") -> Report:
    return report(name, position=replace(POSITION, t_s=t_s))


class Ear:
    """A commander without a screen."""

    def __init__(self, url: str) -> None:
        self.inbox, self.roster, self.times = Inbox(), Roster(), list[float]()
        self.words: list[str] = []
        self.reception = Receiver(Listener(parse_endpoint(url), "echostep/+/+/+", self.hear), self.words.append)

    def hear(self, topic: str | None, payload: bytes, retained: bool) -> None:
        self.inbox.put(topic, payload, retained)
        if topic and topic.endswith("/estimate") and payload.startswith(b'{"echostep_report"'):
            self.times.append((json.loads(payload)["position"] or {}).get("t_s", -1.0))

    def members(self) -> list[Member]:
        update_roster(self.inbox, self.roster)
        return self.roster.members(time.monotonic())

    def only(self) -> Member:
        (member,) = self.members()
        return member


@contextmanager
def listening(url: str) -> Iterator[Ear]:
    ear = Ear(url)
    try:
        until(lambda: ear.reception.connected)
        yield ear
    finally:
        ear.reception.close()


def box_to(url: str, words: list[str] | None = None, name: str = "anna", run: str = "0123abcd") -> Outbox:
    said: list[str] = [] if words is None else words
    endpoint = parse_endpoint(url)
    return Outbox(MqttTransport(endpoint, "red", name, run), str(endpoint), said.append)


@needs_broker
def test_a_broker_that_dies_and_returns_loses_no_later_report(tmp_path: Path) -> None:
    words: list[str] = []
    with Broker(tmp_path) as broker, listening(broker.url) as ear:
        box = box_to(broker.url, words)
        for k in range(20):
            box.offer(at(float(k)))
        until(lambda: 19.0 in ear.times)
        broker.stop()
        until(lambda: words)
        for k in range(100, 105):
            box.offer(at(float(k)))
        broker.start()
        until(lambda: 104.0 in ear.times)
        for k in range(200, 250):
            box.offer(at(float(k)))
        until(lambda: 249.0 in ear.times)
        assert [t for t in ear.times if t >= 200.0] == [float(k) for k in range(200, 250)]
        assert ear.only().state(time.monotonic()) is MemberState.TRACKING
        summary = box.close()
        until(lambda: ear.only().state(time.monotonic()) is MemberState.ENDED)
    assert "broken 1 times" in summary
    assert words[-1].endswith("connected again")


@needs_broker
def test_a_frozen_broker_neither_slows_the_tracker_nor_keeps_old_reports(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(outbox, "FRESH_S", 0.3)
    with Broker(tmp_path) as broker, listening(broker.url) as ear:
        box = box_to(broker.url)
        box.offer(at(0.0))
        until(lambda: 0.0 in ear.times)
        broker.freeze()
        slowest = 0.0
        for k in range(100):
            began = time.perf_counter()
            box.offer(at(1.0 + k))
            slowest = max(slowest, time.perf_counter() - began)
            time.sleep(0.01)
        broker.thaw()
        until(lambda: 100.0 in ear.times)
        box.close()
    assert slowest < 1.0  # a queue that waits for the line would need seconds
    assert len(ear.times) < 80
    assert box.counts.overtaken > 30


@needs_broker
def test_a_tracker_that_vanishes_leaves_its_last_will_and_its_last_place(tmp_path: Path) -> None:
    with Broker(tmp_path) as broker:
        line = MqttTransport(parse_endpoint(broker.url), "red", "anna", "0123abcd")
        line.open()
        line.send(at(7.0))
        line.close(ended=False)
        with listening(broker.url) as ear:
            until(lambda: ear.members() and ear.only().presence == "broken")
            member = ear.only()
            assert (member.retained, member.state(time.monotonic())) == (True, MemberState.STALE)
            assert member.report.position
            assert member.report.position.t_s == 7.0


@needs_broker
def test_a_team_of_twenty_is_followed(tmp_path: Path) -> None:
    with Broker(tmp_path) as broker, listening(broker.url) as ear:
        boxes = [box_to(broker.url, name=f"n{k:02d}", run=f"{k:08x}") for k in range(20)]
        for n in range(20):
            for k, box in enumerate(boxes):
                box.offer(replace(at(float(n), f"n{k:02d}"), run=f"{k:08x}", status="lost" if k == 7 else "tracking"))
            ear.members()
            time.sleep(0.05)
        until(lambda: [m.report.position.t_s for m in ear.members() if m.report.position] == [19.0] * 20)
        first = ear.members()[0]
        assert (first.report.name, first.state(time.monotonic())) == ("n07", MemberState.LOST)
        assert sum(m.missed for m in ear.members()) == 0
        assert ear.roster.rejected == {}
        for box in boxes:
            box.begin_close()
        assert [box.close().split(", ")[0].rpartition(": ")[2] for box in boxes] == ["20 of 20 reports sent"] * 20


@needs_broker
def test_two_trackers_of_one_name_do_not_throw_each_other_out(tmp_path: Path) -> None:
    with Broker(tmp_path) as broker, listening(broker.url) as ear:
        boxes = [box_to(broker.url, run=run) for run in ("11111111", "22222222")]
        for k in range(5):
            for box, run in zip(boxes, ("11111111", "22222222"), strict=True):
                box.offer(replace(at(float(k)), run=run))
        until(lambda: len(ear.members()) == 2)
        assert ear.roster.duplicates(time.monotonic()) == {("red", "anna")}
        assert [box.counts.breaks for box in boxes] == [0, 0]
        for box in boxes:
            box.close()


@needs_broker
@pytest.mark.filterwarnings(
    "ignore::pytest.PytestUnraisableExceptionWarning"
)  # paho leaves a socket that failed to shake hands to the collector
def test_tls_with_client_certificates(tmp_path: Path, certificates: Certificates) -> None:
    c = certificates
    asked = (f"cafile {c.ca}", f"certfile {c.server}", f"keyfile {c.server}", "require_certificate true")
    with Broker(tmp_path, *asked) as broker:
        url = f"mqtts://127.0.0.1:{broker.port}"
        with listening(url + c.query(c.client)) as ear:
            box = box_to(url + c.query(c.client))
            box.offer(at(3.0))
            until(lambda: 3.0 in ear.times)
            box.close()
        for query in (c.query(), c.query(c.stranger)):
            words: list[str] = []
            box = box_to(url + query, words)
            box.offer(at(3.0))
            until(words.__len__)
            assert "trying again" in words[0]
            box.close()
            assert box.counts.sent == 0
        words = []
        box = box_to(url, words)
        until(lambda: words)
        assert "certificate verify failed" in words[0].lower()
        box.close()
    with pytest.raises(EchostepError, match="no such file"):
        box_to("mqtts://127.0.0.1?ca=/no/such.pem")
    (tmp_path / "bad.pem").write_text("nothing")
    with pytest.raises(EchostepError, match=r"bad\.pem"):
        box_to(f"mqtts://127.0.0.1?ca={tmp_path / 'bad.pem'}")


@needs_broker
def test_a_wrong_password_is_said(tmp_path: Path) -> None:
    (tmp_path / "passwords").write_text("")
    with Broker(tmp_path, f"password_file {tmp_path / 'passwords'}") as broker:
        words: list[str] = []
        box = box_to(f"mqtt://me:wrong@127.0.0.1:{broker.port}", words)
        until(lambda: words)
        box.close()
    assert "uthori" in words[0]
    assert "wrong" not in words[0]


@needs_broker
def test_a_commander_survives_garbage_floods_and_a_restart_of_the_broker(tmp_path: Path) -> None:
    rng = random.Random(5)
    with Broker(tmp_path, "max_queued_messages 100000") as broker, listening(broker.url) as ear:
        enemy = paho.Client(CallbackAPIVersion.VERSION2)
        enemy.connect("127.0.0.1", broker.port)
        enemy.loop_start()
        right = encode(report())
        enemy.publish("echostep/red/eve/estimate", b"\xff\xfe{", retain=True)
        enemy.publish("echostep/red/eve/estimate", b"x" * 30_000)
        enemy.publish("echostep/red/eve/estimate", b"x" * 1_000_000)
        enemy.publish("echostep/red/\u202eeve/estimate", right)
        enemy.publish("echostep/red/bob/estimate", right)
        enemy.publish("echostep/red/eve/presence", b"{}")
        until(lambda: ear.members() is not None and sum(ear.roster.rejected.values()) >= 5)
        assert {"not JSON", "too long", "name and topic contradict each other"} <= set(ear.roster.rejected)
        box = box_to(broker.url)
        began = time.monotonic()
        for k in range(10_000):
            enemy.publish("echostep/red/eve/estimate", rng.randbytes(40))
            if k % 500 == 0:
                box.offer(at(float(k)))
        until(lambda: ear.members() is not None and ear.roster.received > 10_000)
        assert time.monotonic() - began < 15.0
        until(lambda: 9500.0 in ear.times)
        assert ear.only().report.name == "anna"
        broker.stop()
        until(lambda: not ear.reception.connected)
        broker.start()
        until(lambda: ear.reception.connected)
        box.offer(at(20_000.0))
        until(lambda: 20_000.0 in ear.times)
        enemy.loop_stop()
        enemy.disconnect()
        box.close()
    assert ear.words[-1] == "connected again"


@pytest.mark.parametrize(
    "nonsense",
    [
        b"",
        b"\x20\x02\x00\x00" + b"\xff" * 50,
        b"\x20\x01",
        b"\x00" * 100,
        b"HTTP/1.1 400 Bad Request\r\n\r\n",
        b"\xff" * 4096,
    ],
)
def test_a_broker_that_speaks_nonsense_stops_nobody(nonsense: bytes) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(0.2)
        served = threading.Event()

        def serve() -> None:
            while not served.is_set():
                try:
                    caller, _ = server.accept()
                except TimeoutError:
                    continue
                with caller:
                    caller.settimeout(0.5)
                    caller.recv(1000)
                    caller.sendall(nonsense)
                    time.sleep(0.05)

        thread = threading.Thread(target=serve)
        thread.start()
        url = f"mqtt://127.0.0.1:{server.getsockname()[1]}"
        words: list[str] = []
        box, ear = box_to(url, words), Ear(url)
        try:
            box.offer(at(1.0))
            until(lambda: words and ear.words)
        finally:
            ear.reception.close()
            box.close()
            served.set()
            thread.join()
    assert "trying again" in words[0]


# Cursor on Target


def test_events_go_out_as_datagrams() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ear:
        ear.bind(("127.0.0.1", 0))
        ear.settimeout(5.0)
        box = Outbox(UdpTransport(parse_endpoint(f"cot+udp://127.0.0.1:{ear.getsockname()[1]}")), "udp", print)
        for k in range(5):
            box.offer(report(f"n{k}"))
        uids = [ElementTree.fromstring(ear.recv(65_536)).get("uid") for _ in range(5)]
        box.close()
    assert uids == [f"echostep-red-n{k}" for k in range(5)]


def test_nobody_listening_for_datagrams_is_no_fault() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ear:
        ear.bind(("127.0.0.1", 0))
        port = ear.getsockname()[1]
    box = Outbox(UdpTransport(parse_endpoint(f"cot+udp://127.0.0.1:{port}")), "udp", print)
    for _ in range(20):
        box.offer(report())
        time.sleep(0.01)
    assert "20 of 20 reports sent" in box.close()


def test_a_multicast_group_is_reached() -> None:
    group, port = "239.2.3.1", 0
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ear:
        ear.bind(("", port))
        try:
            ear.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, socket.inet_aton(group) + b"\0\0\0\0")
        except OSError as error:
            pytest.skip(f"no multicast here: {error}")
        ear.settimeout(3.0)
        words: list[str] = []
        box = Outbox(UdpTransport(parse_endpoint(f"cot+udp://{group}:{ear.getsockname()[1]}")), "udp", words.append)
        box.offer(report())
        try:
            heard = ear.recv(65_536)
        except TimeoutError:
            pytest.skip(f"multicast does not come back to this machine {words}")
        finally:
            box.close()
    assert ElementTree.fromstring(heard).tag == "event"


class Server:
    """A TAK server that only listens."""

    def __init__(self, context: ssl.SSLContext | None = None, port: int = 0, greeting: bytes = b"") -> None:
        self.lines: list[bytes] = []
        self._context, self._greeting = context, greeting
        self._server = socket.create_server(("127.0.0.1", port))
        self._server.settimeout(0.1)
        self.port = self._server.getsockname()[1]
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._serve)
        self._thread.start()

    def stop(self) -> None:
        self._ended.set()
        self._thread.join(10.0)
        self._server.close()

    def _serve(self) -> None:
        while not self._ended.is_set():
            try:
                caller, _ = self._server.accept()
                caller.settimeout(2.0)
                if self._context:
                    caller = self._context.wrap_socket(caller, server_side=True)
            except OSError:
                continue
            with caller:
                self._listen(caller)

    def _listen(self, caller: socket.socket) -> None:
        caller.settimeout(0.1)
        rest = b""
        caller.sendall(self._greeting)
        while not self._ended.is_set():
            try:
                got = caller.recv(65_536)
            except TimeoutError:
                continue
            except OSError:
                return
            if not got:
                return
            *lines, rest = (rest + got).split(b"\n")
            self.lines += lines


def test_events_go_out_on_a_stream_through_a_restart_of_the_server() -> None:
    server, words = Server(greeting=b"<event/>" * 20_000), list[str]()
    box = Outbox(StreamTransport(parse_endpoint(f"cot+tcp://127.0.0.1:{server.port}")), "tcp", words.append)
    box.offer(report("first"))
    until(lambda: server.lines)
    server.stop()
    while not words:
        box.offer(report("between"))
        time.sleep(0.01)
    again = Server(port=server.port)
    until(lambda: "tcp: connected again" in words)
    for k in range(20):
        box.offer(report(f"n{k}"))
    until(lambda: any(b"echostep-red-n19" in line for line in again.lines))
    box.close()
    again.stop()
    names = [ElementTree.fromstring(line).get("uid") for line in again.lines]
    assert names[-20:] == [f"echostep-red-n{k}" for k in range(20)]


def test_a_stream_server_that_stops_reading_does_not_hold_old_positions() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        words: list[str] = []
        box = Outbox(
            StreamTransport(parse_endpoint(f"cot+tcp://127.0.0.1:{server.getsockname()[1]}")), "tcp", words.append
        )
        slowest = 0.0
        for k in range(2000):
            began = time.perf_counter()
            box.offer(at(float(k)))
            slowest = max(slowest, time.perf_counter() - began)
        until(lambda: words, 12.0)
        assert "timed out" in words[0]
        assert slowest < 1.0  # a queue that waits for the line would need seconds
        assert box.counts.sent < 500
        box.close()


def test_events_go_out_by_tls_with_a_client_certificate(certificates: Certificates) -> None:
    c = certificates
    context = ssl.create_default_context(ssl.Purpose.CLIENT_AUTH, cafile=str(c.ca))
    context.load_cert_chain(c.server)
    context.verify_mode = ssl.CERT_REQUIRED
    server = Server(context)
    url = f"cot+tls://127.0.0.1:{server.port}"
    box = Outbox(StreamTransport(parse_endpoint(url + c.query(c.client))), "tls", print)
    box.offer(report())
    until(lambda: server.lines)
    box.close()
    words: list[str] = []
    distrusting = Outbox(StreamTransport(parse_endpoint(url)), "tls", words.append)
    distrusting.offer(report())
    until(lambda: words)
    distrusting.close()
    server.stop()
    assert ElementTree.fromstring(server.lines[0]).get("uid") == "echostep-red-anna"
    assert "certificate verify failed" in words[0]


# the commands


@needs_broker
def test_a_demo_is_published_and_commanded(tmp_path: Path) -> None:
    with Broker(tmp_path) as broker:
        commander = subprocess.Popen(
            [*ECHOSTEP, "command", "--plan", PLAN, broker.url, "--json", "--seconds", "300", "--picture", tmp_path / "team.png"],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        try:
            box = box_to(broker.url, name="bob")
            box.offer(report("bob", status="lost"))
            demo = subprocess.run(
                [*ECHOSTEP, "demo", "--headless", "--out", tmp_path / "demo", "--name", "anna", "--team", "red",
                 "--publish", broker.url, "--publish", "mqtt://127.0.0.1:9"],
                capture_output=True, text=True, timeout=120, check=False,
            )  # fmt: skip
            assert demo.returncode == 0, demo.stderr
            assert "0 unsent" in demo.stdout
            assert "tracking goes on" in demo.stdout
            box.offer(report("bob", status="lost"))
            time.sleep(1.0)
        finally:
            commander.send_signal(2)
            out, err = commander.communicate(timeout=20)
        assert commander.returncode == 0, err
        box.close()
    roster = json.loads(out)
    assert [(m["name"], m["state"]) for m in roster["members"]] == [("bob", "lost"), ("anna", "ended")]
    assert roster["members"][1]["report"]["motion"]["steps"] > 10
    assert roster["members"][1]["from_start_m"] > 1.0
    assert (tmp_path / "team.png").stat().st_size > 10_000
    _replays_alike(tmp_path)


def _replays_alike(folder: Path) -> None:
    """Published or not, the track is the same; Cursor on Target goes out where the plan lies on Earth."""
    plan = folder / "placed.json"
    plan.write_text(
        json.dumps(json.loads(PLAN.read_text()) | {"georeference": {"origin": [16.37, 48.2], "rotation_deg": 20.0}})
    )
    replay = [*ECHOSTEP, "replay", str(folder / "demo/walk.mcap"), "--headless", "--out"]
    subprocess.run([*replay, str(folder / "quiet"), "--plan", str(PLAN)], capture_output=True, timeout=120, check=True)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ear:
        ear.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
        ear.bind(("127.0.0.1", 0))
        ear.settimeout(5.0)
        more = ["--publish", f"cot+udp://127.0.0.1:{ear.getsockname()[1]}", "--name", "anna"]
        subprocess.run(
            [*replay, str(folder / "loud"), "--plan", str(plan), *more], capture_output=True, timeout=120, check=True
        )
        top = ElementTree.fromstring(ear.recv(65_536))
    tracks = {name: (folder / name / "track.csv").read_bytes() for name in ("demo", "quiet", "loud")}
    assert tracks["demo"] == tracks["quiet"] == tracks["loud"]
    point = top.find("point")
    assert point is not None
    assert float(point.get("lat", "0")) == pytest.approx(48.2, abs=3e-4)
    assert float(point.get("lon", "0")) == pytest.approx(16.37, abs=4e-4)
    assert 0.0 < float(point.get("ce", "0")) < 1.0
    assert "replay" in (top.findtext("detail/remarks") or "")


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["command", "--plan", PLAN, "http://x"], "mqtt://"),
        (["command", "--plan", "none.json", "mqtt://x"], "none.json"),
        (["command", "--plan", PLAN, "mqtt://x", "--picture", "a.gif"], "a.gif"),
        (["command", "--plan", PLAN, "mqtt://x", "--team", "a/b"], "--team"),
        (["demo", "--headless", "--publish", "mqtt://x"], "--name"),
        (["demo", "--headless", "--publish", "mqtt://x", "--name", "a#"], "--name"),
        (["demo", "--headless", "--publish", "cot+udp://x", "--name", "a"], "georeference"),
    ],
)
def test_a_mistake_is_named_in_one_line(tmp_path: Path, arguments: list[object], named: str) -> None:
    more = ["--out", tmp_path] if arguments[0] == "demo" else []
    with pytest.raises(EchostepError, match=named) as found:
        app([*map(str, arguments), *map(str, more)], standalone_mode=False)
    assert "\n" not in str(found.value)
    assert not (tmp_path / "walk.mcap").exists()


def test_the_presence_is_a_report_of_its_own() -> None:
    assert json.loads(encode(Presence(1, "0123abcd", "online"))) == {
        "echostep_presence": 1,
        "run": "0123abcd",
        "presence": "online",
    }
