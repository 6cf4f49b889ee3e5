# SPDX-License-Identifier: MIT
"""The most likely mistakes: each is provoked, and what is printed stands in host/docs/mistakes.md, with names in capitals for what differs."""

from __future__ import annotations

import os
import re
import signal
import subprocess
from collections import deque
from collections.abc import Callable
from pathlib import Path

import pytest
import trustme
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import BestAvailableEncryption
from cryptography.hazmat.primitives.serialization.pkcs12 import serialize_key_and_certificates

from board_runs import ROOT
from command_line import echostep, fill_disk, interrupt_once_called
from echostep.board import messages as m
from echostep.board.frames import encode
from echostep_app.printing.console import print_notices
from echostep_app.recording.background_writer import BackgroundWriter
from echostep_app.team.outbox import Outbox
from echostep_studies.simulation.devices.mtx_setup import FACTORY, MtxDevice
from players import babbling_port, pseudo_terminal, python_board
from team.team_broker import MOSQUITTO, Broker
from waiting import PATIENCE_S
from walks import DEMO, WALK
from xsens.mt_lines import on_a_terminal

PAGE = ROOT / "host/docs/mistakes.md"
Finished = subprocess.CompletedProcess[str]
ROWS = dict(re.findall(r"^\| ([^|]+) \| `([^`]+)`", PAGE.read_text(), flags=re.M))  # what is printed, by mistake
# {"said": what is printed, and what to put capitals for}
Mistake = Callable[[Path, pytest.MonkeyPatch], dict[str, str]]


def live(folder: Path, *arguments: object, plan: object = DEMO, **names: object) -> dict[str, str]:
    """What `live` prints as its error, which is one line, and the names of what differs."""
    done = echostep("live", "--plan", plan, "--headless", "--out", folder / "out", "--seconds", PATIENCE_S, *arguments)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1), done.stdout + done.stderr
    return {"said": done.stderr.removeprefix("echostep: ").strip()} | {
        name: str(value) for name, value in names.items()
    }


def swapped_ports(folder: Path, _patch: pytest.MonkeyPatch) -> dict[str, str]:
    with python_board() as board, on_a_terminal(MtxDevice(FACTORY, deaf=True)) as mtx:
        return live(folder, "--board", mtx, "--mtx", board, PORT1=mtx, PORT2=board)


def another_format(folder: Path, _patch: pytest.MonkeyPatch) -> dict[str, str]:
    path = folder / "plan.pdf"
    path.write_bytes(b"%PDF-1.7 a drawing")
    return live(folder, "--board", "x", plan=path, PLAN=path)


def wrong_firmware(folder: Path, _patch: pytest.MonkeyPatch) -> dict[str, str]:
    with babbling_port(b"\0" + encode(m.Identity(0, 0x12345678, 1, 0, 0, 0), 0)) as port:
        return live(folder, "--board", port, HASH=f"0x{m.SCHEMA_HASH:08X}")


def no_rights(folder: Path, patch: pytest.MonkeyPatch) -> dict[str, str]:
    access = os.access
    patch.setattr(os, "access", lambda path, mode: "/pts/" not in str(path) and access(path, mode))
    with pseudo_terminal() as (_, port):
        owner = f"{Path(port).owner()}:{Path(port).group()}"
        return live(folder, "--board", port, PORT=port) | {"OWNER:GROUP": owner, "GROUP": Path(port).group()}


def no_broker(folder: Path, patch: pytest.MonkeyPatch) -> dict[str, str]:
    url = "mqtt://127.0.0.1:9"
    said, say = list[str](), Outbox._print_state

    def heard(box: Outbox, text: str) -> None:
        say(box, text)
        said.append(text)

    def ending(notices: deque[str]) -> None:
        print_notices(notices)
        if said and said.pop():
            signal.raise_signal(signal.SIGINT)

    patch.setattr(Outbox, "_print_state", heard)
    patch.setattr("echostep_app.session.runs.live.print_notices", ending)
    with pseudo_terminal() as (_, port):
        done = echostep(
            "live", "--plan", DEMO, "--board", port, "--headless", "--out", folder, "--publish", url, "--name", "anna",
            "--seconds", PATIENCE_S,
        )  # fmt: skip
    return {"said": goes_on(done), "URL": url}


def publish_walk(folder: Path, url: str, *more: str) -> Finished:
    """A replay that publishes to this URL."""
    return echostep(
        "replay", WALK, "--plan", DEMO, "--headless", "--out", folder, "--publish", url, "--name", "anna", *more
    )


def goes_on(done: Finished) -> str:
    """What is said of a fault that ends nothing."""
    assert done.returncode == 0, done.stderr
    return next(line for line in done.stdout.splitlines() if "tracking goes on" in line)


def refused_reports(folder: Path, _patch: pytest.MonkeyPatch) -> dict[str, str]:
    (folder / "pw").write_text("")
    (folder / "acl").write_text("topic readwrite echostep/green/#\n")
    with Broker(folder, f"acl_file {folder / 'acl'}") as broker:
        return {"said": goes_on(publish_walk(folder, broker.url, "--team", "red")), "URL": broker.url}


def publishing(folder: Path, url: str) -> str:
    """The error of a replay that publishes to this URL."""
    done = publish_walk(folder, url)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1), done.stdout + done.stderr
    return done.stderr.removeprefix("echostep: ").strip()


def pkcs12(folder: Path, _patch: pytest.MonkeyPatch) -> dict[str, str]:
    key = ec.generate_private_key(ec.SECP256R1())
    path = folder / "client.p12"
    path.write_bytes(serialize_key_and_certificates(None, key, None, None, BestAvailableEncryption(b"secret")))
    url = "cot+tls://127.0.0.1:8089"
    return {"said": publishing(folder, f"{url}?cert={path}"), "URL": url, "FILE": str(path)}


def other_name(folder: Path, _patch: pytest.MonkeyPatch) -> dict[str, str]:
    authority = trustme.CA()
    authority.cert_pem.write_to_path(str(folder / "ca.pem"))
    authority.issue_cert("takserver").private_key_and_cert_chain_pem.write_to_path(str(folder / "server.pem"))
    keys = f"certfile {folder / 'server.pem'}", f"keyfile {folder / 'server.pem'}"
    with Broker(folder, *keys) as broker:
        url = f"mqtts://127.0.0.1:{broker.port}"
        return {"said": goes_on(publish_walk(folder, f"{url}?ca={folder / 'ca.pem'}")), "URL": url}


def disk_full(folder: Path, patch: pytest.MonkeyPatch) -> dict[str, str]:
    fill_disk(patch, 1_000)
    interrupt_once_called(BackgroundWriter, "_write_to_file", patch, lambda writer, *_: writer.failed)
    patch.setattr("echostep_app.recording.background_writer.CLOSE_S", 0.5)
    with python_board() as port:
        done = echostep("record", "--board", port, "--out", folder / "walk.mcap", "--seconds", PATIENCE_S)
    assert (done.returncode, done.stderr.count("\n")) == (1, 1), done.stderr
    assert done.stderr.endswith(".mcap: the recording is not whole; all else was done\n")
    said = next(line for line in done.stdout.splitlines() if "tracking goes on" in line)
    return {"said": re.sub(r"\S+\.mcap", "FILE", said)}


MISTAKES: dict[str, Mistake] = {
    "a port that does not exist": lambda folder, _: live(folder, "--board", "/dev/ttyACM7", PORT="/dev/ttyACM7"),
    "the ports are swapped": swapped_ports,
    "there is no plan": lambda folder, _: live(
        folder, "--board", "x", plan=folder / "plan.json", PLAN=folder / "plan.json"
    ),
    "the plan has a format that cannot be read": another_format,
    "the start is outside of the building": lambda folder, _: live(folder, "--board", "x", "--start", "75,7.5,0"),
    "the start is in a wall": lambda folder, _: live(folder, "--board", "x", "--start", "7,3,0"),
    "the board has another firmware": wrong_firmware,
    "no right to open the port": no_rights,
    "the broker is not there": no_broker,
    "the broker refuses the reports": refused_reports,
    "a certificate in PKCS #12 has a password of its own": pkcs12,
    "a certificate is for another name": other_name,
    "the disk is full": disk_full,
}
WITH_BROKER = ("the broker refuses the reports", "a certificate is for another name")
WITH_PROCESS = (*WITH_BROKER, "the plan has a format that cannot be read")


@pytest.mark.slow
# Paho leaves a socket that failed to shake hands to the collector
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize(
    "mistake", [pytest.param(name, marks=pytest.mark.process if name in WITH_PROCESS else ()) for name in MISTAKES]
)
def test_what_a_mistake_prints_stands_in_the_manual(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, mistake: str
) -> None:
    if mistake in WITH_BROKER and MOSQUITTO is None:
        pytest.skip("mosquitto is not installed (apt install mosquitto)")
    values = MISTAKES[mistake](tmp_path, monkeypatch)
    said = values.pop("said")
    for name, value in values.items():
        said = said.replace(value, name)
    assert ROWS.get(mistake) == said


def test_each_row_of_the_manual_is_provoked_by_a_test() -> None:
    assert list(ROWS) == list(MISTAKES)
    assert PAGE.read_text().count("\n| ") == len(ROWS) + 1  # with the row of the heads
