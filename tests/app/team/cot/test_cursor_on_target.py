# SPDX-License-Identifier: MIT
"""Cursor on Target over UDP, TCP and TLS, and a whole demo published and commanded."""

from __future__ import annotations

import json
import socket
import ssl
import subprocess
import threading
import time
from functools import partial
from pathlib import Path
from xml.etree import ElementTree

import pytest

from command_line import PROGRAM
from echostep.errors import EchostepError
from echostep_app.cli import app
from echostep_app.team import outbox
from echostep_app.team.cot import StreamTransport, UdpTransport
from echostep_app.team.endpoint import parse_endpoint
from echostep_app.team.messages.report import Presence, encode
from echostep_app.team.outbox import Outbox
from free_ports import free_port
from team.network import at, box_to
from team.team_broker import Broker, Certificates, needs_broker
from team.team_reports import report
from waiting import PATIENCE_S, ends, until
from walks import DEMO

pytestmark = pytest.mark.usefixtures("quick")


@pytest.mark.usefixtures("patient")
def test_events_go_out_as_datagrams() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ear:
        ear.bind(("127.0.0.1", 0))
        ear.settimeout(PATIENCE_S)
        box = Outbox(UdpTransport(parse_endpoint(f"cot+udp://127.0.0.1:{ear.getsockname()[1]}")), "udp", print)
        for k in range(5):
            box.offer(report(f"n{k}"))
        uids = [ElementTree.fromstring(ear.recv(65_536)).get("uid") for _ in range(5)]
        box.close()
    assert uids == [f"echostep-red-n{k}" for k in range(5)]


@pytest.mark.usefixtures("patient")
def test_nobody_listening_for_datagrams_is_no_fault() -> None:
    port = free_port(socket.SOCK_DGRAM)
    box = Outbox(UdpTransport(parse_endpoint(f"cot+udp://127.0.0.1:{port}")), "udp", print)
    for _ in range(20):
        box.offer(report())
        time.sleep(0.01)
    assert box.close().startswith("udp: ")
    assert box.counts.sent + box.counts.left_out == 20
    assert box.counts.left_out > 0  # the operating system says that nothing listens there
    assert box.counts.breaks == 0


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
        self._thread.join(PATIENCE_S)
        self._server.close()

    def _serve(self) -> None:
        while not self._ended.is_set():
            try:
                caller, _ = self._server.accept()
                caller.settimeout(PATIENCE_S)
                if self._context:
                    caller = self._context.wrap_socket(caller, server_side=True)
            except OSError:
                continue
            with caller:
                self._listen(caller)

    def _listen(self, caller: socket.socket) -> None:
        rest = b""
        caller.sendall(self._greeting)
        caller.settimeout(0.1)
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


@pytest.mark.usefixtures("patient")
def test_events_go_out_on_a_stream_through_a_restart_of_the_server(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(outbox, "HEARTBEAT_S", PATIENCE_S)
    server, words = Server(port=free_port(), greeting=b"<event/>" * 20_000), list[str]()
    box = Outbox(StreamTransport(parse_endpoint(f"cot+tcp://127.0.0.1:{server.port}")), "tcp", words.append)
    box.offer(report("first"))
    assert until(lambda: server.lines)
    server.stop()

    def has_broken() -> bool:
        box.offer(report("between"))
        return bool(words)

    assert until(has_broken)
    again = Server(port=server.port)
    assert until(lambda: "tcp: connected again" in words)
    for k in range(20):
        box.offer(report(f"n{k}"))
    assert until(lambda: any(b"echostep-red-n19" in line for line in again.lines))
    box.close()
    again.stop()
    names = [ElementTree.fromstring(line).get("uid") for line in again.lines]
    assert names[-20:] == [f"echostep-red-n{k}" for k in range(20)]


@pytest.mark.slow
def test_a_stream_server_that_stops_reading_does_not_hold_old_positions() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        words: list[str] = []
        box = Outbox(
            StreamTransport(parse_endpoint(f"cot+tcp://127.0.0.1:{server.getsockname()[1]}")), "tcp", words.append
        )

        def offer_all() -> None:
            for k in range(2000):
                box.offer(at(float(k)))

        assert ends(offer_all)  # although the line stands still
        assert until(lambda: words)
        assert "the host does not answer" in words[0]
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
    assert until(lambda: server.lines)
    box.close()
    server.stop()
    assert ElementTree.fromstring(server.lines[0]).get("uid") == "echostep-red-anna"


@pytest.mark.long
@needs_broker
def test_a_demo_is_published_and_commanded(tmp_path: Path) -> None:
    with Broker(tmp_path) as broker:
        commander = subprocess.Popen(
            [*PROGRAM, "command", "--plan", DEMO, broker.url, "--json", "--seconds", "300",
             "--out", tmp_path / "operation.mcap"],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        try:
            box = box_to(broker.url, name="bob")
            box.offer(report("bob", status="lost"))
            demo = subprocess.run(
                [*PROGRAM, "demo", "--headless", "--out", tmp_path / "demo", "--name", "anna", "--team", "red",
                 "--publish", broker.url, "--publish", "mqtt://127.0.0.1:9"],
                capture_output=True, text=True, timeout=3.0 * PATIENCE_S, check=False,
            )  # fmt: skip
            assert demo.returncode == 0, demo.stderr
            assert "0 unsent" in demo.stdout
            assert "tracking goes on" in demo.stdout
            box.offer(report("bob", status="lost"))
            assert until(lambda: box.counts.sent == 2)
            (operation,) = tmp_path.glob("operation*.mcap")
            assert until(lambda: b'"presence":"ended"' in operation.read_bytes())
        finally:
            commander.send_signal(2)
            out, err = commander.communicate(timeout=PATIENCE_S)
        assert commander.returncode == 0, err
        box.close()
    roster = json.loads(out)
    assert [(m["name"], m["state"]) for m in roster["members"]] == [("bob", "lost"), ("anna", "ended")]
    assert roster["members"][1]["report"]["motion"]["steps"] > 10
    ended = roster["members"][1]["report"]
    place = ended["position"] or ended["last_place"]  # where a slow computer takes 2 s to end
    assert place["x_m"] > 3.0
    _replays_alike(tmp_path)


def _replays_alike(folder: Path) -> None:
    """Published or not, the track is the same; Cursor on Target goes out where the plan lies on Earth."""
    plan = folder / "placed.json"
    plan.write_text(
        json.dumps(json.loads(DEMO.read_text()) | {"georeference": {"origin": [16.37, 48.2], "rotation_deg": 20.0}})
    )
    replay = partial(subprocess.run, capture_output=True, timeout=3.0 * PATIENCE_S, check=True)
    command = [*PROGRAM, "replay", folder / "demo/walk.mcap", "--headless", "--out"]
    replay([*command, folder / "quiet", "--plan", DEMO])
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ear:
        ear.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
        ear.bind(("127.0.0.1", 0))
        ear.settimeout(PATIENCE_S)
        more = ["--publish", f"cot+udp://127.0.0.1:{ear.getsockname()[1]}", "--name", "anna"]
        replay([*command, folder / "loud", "--plan", plan, *more])
        top = ElementTree.fromstring(ear.recv(65_536))
    tracks = {name: (folder / name / "track.csv").read_bytes() for name in ("demo", "quiet", "loud")}
    assert tracks["demo"] == tracks["quiet"] == tracks["loud"]
    point = top.find("point")
    assert point is not None
    assert float(point.get("lat", "0")) == pytest.approx(48.2, abs=3e-4)
    assert float(point.get("lon", "0")) == pytest.approx(16.37, abs=4e-4)
    assert 0.0 < float(point.get("ce", "0")) < 1.0
    assert top.get("how") == "m-s", "the recording is of a simulation"
    assert "simulated" in (top.findtext("detail/remarks") or "")


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["command", "--plan", DEMO, "http://x"], "mqtt://"),
        (["command", "--plan", "none.json", "mqtt://x"], "none.json"),
        (["command", "--plan", DEMO, "mqtt://x", "--team", "a/b"], "--team"),
        (["demo", "--headless", "--publish", "mqtt://x"], "--name"),
        (["demo", "--headless", "--publish", "mqtt://x", "--name", "a#"], "--name"),
        (["demo", "--headless", "--publish", "cot+udp://x", "--name", "a", "--plan", "nowhere.json"], "georeference"),
    ],
)
def test_a_mistake_is_named_in_one_line(tmp_path: Path, arguments: list[object], named: str) -> None:
    more = ["--out", tmp_path] if arguments[0] == "demo" else []
    tree = {key: value for key, value in json.loads(DEMO.read_text()).items() if key != "georeference"}
    (tmp_path / "nowhere.json").write_text(json.dumps(tree))
    arguments = [tmp_path / name if name == "nowhere.json" else name for name in arguments]
    with pytest.raises(EchostepError, match=named) as found:
        app([*map(str, arguments), *map(str, more)], standalone_mode=False)
    assert "\n" not in str(found.value)
    assert not (tmp_path / "walk.mcap").exists()


def test_the_presence_is_a_report_of_its_own() -> None:
    expected = {"echostep_presence": 1, "run": "0123abcd", "presence": "online"}
    assert json.loads(encode(Presence(1, "0123abcd", "online"))) == expected
