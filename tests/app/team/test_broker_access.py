# SPDX-License-Identifier: MIT
"""TLS and access rules of a real broker: each refusal is one sentence with the next step, told once, and costs no more than what it refuses."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest

from echostep_app.team.endpoint import parse_endpoint
from echostep_app.team.inbox import ListenerThread
from echostep_app.team.mqtt.publisher import Listener
from free_ports import free_port
from team.network import at, box_to
from team.team_broker import Broker, Certificates, needs_broker
from waiting import until

pytestmark = [
    needs_broker,
    pytest.mark.usefixtures("quick"),
    pytest.mark.filterwarnings(
        "ignore::pytest.PytestUnraisableExceptionWarning"
    ),  # paho leaves a socket that failed to shake hands to the collector
]


def told(url: str) -> str:
    """The first that is said of a report that cannot go there."""
    words: list[str] = []
    box = box_to(url, words)
    box.offer(at(1.0))
    assert until(lambda: words)
    box.close()
    assert box.counts.sent == 0
    return words[0].removesuffix("; tracking goes on, trying again")


@pytest.mark.parametrize(
    ("server", "said"),
    [
        ("old", "the server's certificate is not valid today: renew it, or set this computer's clock"),
        ("stranger", "give the file of the authority that has signed it with ca=FILE"),
    ],
)
def test_a_certificate_that_is_not_right_is_told(
    tmp_path: Path, certificates: Certificates, server: str, said: str
) -> None:
    path = getattr(certificates, server)
    with Broker(tmp_path, f"certfile {path}", f"keyfile {path}") as broker:
        assert said in told(f"mqtts://127.0.0.1:{broker.port}{certificates.query()}")


@pytest.mark.parametrize("client", [None, "stranger", "old_client"])
def test_a_broker_that_wants_another_certificate_of_the_client_says_so(
    tmp_path: Path, certificates: Certificates, client: str | None
) -> None:
    """By TLS 1.3 it ends the connection after the handshake, and does not answer."""
    c = certificates
    asked = (f"cafile {c.ca}", f"certfile {c.server}", f"keyfile {c.server}", "require_certificate true")
    with Broker(tmp_path, *asked) as broker:
        url = f"mqtts://127.0.0.1:{broker.port}{c.query(getattr(c, client) if client else None)}"
        assert told(url).endswith("give cert=FILE&key=FILE that its authority has signed, and that is valid today")


def test_a_wrong_password_names_what_to_check(tmp_path: Path) -> None:
    (tmp_path / "passwords").write_text("")
    with Broker(tmp_path, f"password_file {tmp_path / 'passwords'}") as broker:
        said = told(f"mqtt://me:wrong@127.0.0.1:{broker.port}")
    assert said.endswith(
        "the broker refuses user me (Not authorized): check user and password, mqtt://USER:PASSWORD@HOST"
    )
    assert "wrong" not in said


def test_reports_that_are_refused_behind_an_accepted_presence_are_told_once(tmp_path: Path) -> None:
    rules = tmp_path / "rules"
    rules.write_text("topic write echostep/red/anna/presence\n")
    with Broker(tmp_path, f"acl_file {rules}") as broker:
        words: list[str] = []
        box = box_to(broker.url, words)
        box.offer(at(1.0))
        assert until(lambda: box.counts.breaks >= 3)
        (said,) = words
        assert "does not let a client without a user name publish as red/anna (Not authorized)" in said
        assert box.fault in said
        rules.write_text("topic write echostep/red/anna/#\n")
        broker.reload()
        assert until(lambda: box.counts.sent == 1)
        assert (words[1:], box.fault) == ([f"{box.name}: connected again"], "")
        box.close()


SECURITY = Path("/usr/lib/x86_64-linux-gnu/mosquitto_dynamic_security.so")


@pytest.mark.skipif(not SECURITY.exists(), reason="mosquitto has no plugin that refuses subscriptions")
def test_a_topic_that_may_not_be_read_costs_itself_alone(tmp_path: Path) -> None:
    """One that may not be written too; both are told once, on terminal and page, for as long as they hold."""
    rules, port = tmp_path / "rules.json", free_port()
    broker = Broker(tmp_path, f"plugin {SECURITY}", f"plugin_opt_config_file {rules}", port=port)
    subprocess.run(["mosquitto_ctrl", "dynsec", "init", rules, "admin", "secret"], check=True, capture_output=True)
    with broker:

        def rule(*words: str) -> None:
            server = ["mosquitto_ctrl", "-h", "127.0.0.1", "-p", str(port), "-u", "admin", "-P", "secret", "dynsec"]
            subprocess.run([*server, *words], check=True, capture_output=True)

        _people(rule)
        words, heard = list[str](), list[str | None]()
        endpoint = parse_endpoint(f"mqtt://bo:secret@127.0.0.1:{port}")
        listener = Listener(endpoint, ["echostep/red/+/+", "echostep/marks/+"], lambda topic, *_: heard.append(topic))
        with closing(ListenerThread(listener, words.append)) as receiver:
            refused = "the broker refuses user bo the subscription to echostep/red/+/+"
            assert until(lambda: receiver.fault.startswith(refused))
            assert receiver.connected
            for payload in (b"1", b"2"):
                receiver.send("echostep/red/bo/beacons", payload)
            assert until(lambda: not receiver.waiting)
            receiver.send("echostep/marks/a", b"{}")
            assert until(lambda: heard == ["echostep/marks/a"])
            assert until(lambda: receiver.fault.startswith(refused))
        assert [line.split(":")[0] for line in words] == [
            refused,
            "the broker does not accept what is sent on echostep/red/bo/beacons (Not authorized)",
        ]


def _people(rule: Callable[..., None]) -> None:
    """A user who may read and write marks and nothing else."""
    for command in (
        "createClient bo -p secret",
        "createRole marks",
        "addRoleACL marks subscribePattern echostep/marks/# allow 1",
        "addRoleACL marks publishClientSend echostep/marks/# allow 1",
        "addRoleACL marks publishClientReceive echostep/marks/# allow 1",
        "addClientRole bo marks 1",
    ):
        rule(*command.split())


def test_a_broker_of_qos_0_gets_reports_that_count_as_sent(tmp_path: Path) -> None:
    """It announces that in its answer, and ends the connection of who sends another one."""
    words: list[str] = []
    with Broker(tmp_path, "max_qos 0") as broker:
        box = box_to(f"mqtt://127.0.0.1:{broker.port}", words)
        box.offer(at(1.0))
        assert until(lambda: box.counts.sent == 1), words
        box.close()
    assert not words
