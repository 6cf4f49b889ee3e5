# SPDX-License-Identifier: MIT
"""Ports: found again by serial number, read in blocks over TCP; the end of a run loses nothing that had arrived; sleep is noticed."""

from __future__ import annotations

import os
import signal
import socket
from contextlib import closing
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from serial.tools import list_ports

from command_line import echostep
from echostep.errors import EchostepError
from echostep.ports.chunks import Chunk
from echostep.recording import open_recording
from echostep_app.ports.access import port_of_number, usb_number
from echostep_app.ports.arrival_clock import SleepWatch, now_ns
from echostep_app.ports.serial_ports import ChunkQueue, SerialPorts
from echostep_app.recording.recorder import Recorder
from echostep_app.session.runs import live
from players import pseudo_terminal
from waiting import PATIENCE_S, until


def plugged(monkeypatch: pytest.MonkeyPatch, **numbers: str) -> None:
    """The system lists these ports: serial number by path, with _ for /."""
    seen = [SimpleNamespace(device=path.replace("_", "/"), serial_number=number) for path, number in numbers.items()]
    monkeypatch.setattr(list_ports, "comports", lambda: seen)


def test_a_number_that_two_devices_share_tells_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    plugged(monkeypatch, _dev_a="7", _dev_b="8", _dev_c="8")
    assert [usb_number(f"/dev/{port}") for port in "abcd"] == ["7", "", "", ""]
    assert port_of_number("7") == "/dev/a"
    assert port_of_number("9") is None


def test_a_device_under_a_new_name_is_found_by_its_number(monkeypatch: pytest.MonkeyPatch) -> None:
    with pseudo_terminal() as (board, was), pseudo_terminal() as (again, now), pseudo_terminal() as (stranger, other):
        plugged(monkeypatch, **{was.replace("/", "_"): "7"})
        with closing(SerialPorts({"board": was}, {"board": 115200})) as ports:
            plugged(monkeypatch, **{other.replace("/", "_"): "9"})  # another device, first
            ports._ports["board"].close()
            assert until(lambda: any("went away" in notice for notice in ports.notices))
            plugged(monkeypatch, **{other.replace("/", "_"): "9", now.replace("/", "_"): "7"})
            assert until(lambda: any(f"is back as {now}" in notice for notice in ports.notices))
            os.write(again, b"hello")
            chunks = (chunk for chunk in ports.chunks() if chunk is not None)
            assert next(chunks).data == b""  # the sign that the port was opened again
            assert next(chunks).data == b"hello"
            assert ports.urls == {"board": now}
    del board, stranger


def test_bytes_over_tcp_come_in_blocks_and_a_closed_connection_is_made_again() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(PATIENCE_S)
        url = f"socket://127.0.0.1:{server.getsockname()[1]}"
        with closing(SerialPorts({"board": url}, {"board": 115200})) as ports:
            bridge, _ = server.accept()
            sent = bytes(range(256)) * 40
            bridge.sendall(sent)
            received, chunks = b"", (chunk for chunk in ports.chunks() if chunk is not None)
            count = 0
            while len(received) < len(sent):
                received, count = received + next(chunks).data, count + 1
            assert received == sent
            assert count < 20
            ports.send("board", b"question")
            assert bridge.recv(100) == b"question"
            bridge.close()
            with server.accept()[0] as bridge:
                bridge.sendall(b"again")
            assert until(lambda: any(chunk.data == b"again" for chunk in [next(chunks)]))


@pytest.mark.parametrize("url", ["socket://127.0.0.1:1", "socket://127.0.0.1", "socket://127.0.0.1:99999"])
def test_an_address_where_nothing_answers_is_one_sentence(url: str) -> None:
    with pytest.raises(EchostepError, match=r"socket://127\.0\.0\.1.*(ser2net|expected socket://HOST:PORT)"):
        SerialPorts({"board": url}, {"board": 115200})


def test_what_has_arrived_comes_after_stop() -> None:
    with pseudo_terminal() as (ours, port):
        ports = SerialPorts({"board": port}, {"board": 115200})
        chunks = ports.chunks()
        os.write(ours, b"first")
        received = b""
        while not received:
            received += getattr(next(chunks), "data", b"")
        os.write(ours, b", second")
        opened: Any = ports._ports["board"]
        assert until(lambda: opened.in_waiting or ports._queue._chunks)  # a pseudo terminal hands it over later
        ports.stop()
        os.write(ours, b", third")
        received += b"".join(chunk.data for chunk in chunks if chunk)
        ports.close()
    assert received == b"first, second"


def test_a_port_whose_close_fails_is_closed_once() -> None:
    """A second close would hit another file that has the number meanwhile."""
    with pseudo_terminal() as (_, port):
        ports = SerialPorts({"board": port}, {"board": 115200})
        opened: Any = ports._ports["board"]
        close, closed = opened.close, list[int]()

        def failing() -> None:
            if opened.fd is not None:
                closed.append(opened.fd)
                raise OSError(5, "Input/output error")

        opened.close = failing
        ports.close()
        ports.close()
        assert len(closed) == 1
        opened.fd = closed[0]
        close()


@pytest.mark.parametrize(
    ("command", "end"),
    [("record", "SIGTERM"), ("live", "SIGTERM"), ("live", "SIGINT"), ("live", "SIGQUIT"), ("live", "SIGHUP")],
)
def test_a_signal_ends_a_run_that_is_behind_with_all_that_had_arrived(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: str, end: str
) -> None:
    """The disk, or a kernel that is compiled, holds the run up while its port goes on."""
    write, put, sent, queued = Recorder.write, ChunkQueue.put, [b"begin"], list[bytes]()
    with pseudo_terminal() as (ours, port):

        def held_up(recorder: Recorder, chunk: Chunk) -> None:
            if chunk.port == "board" and len(sent) < 50:
                for number in range(50):
                    sent.append(f", {number}".encode())
                    os.write(ours, sent[-1])
                # A pseudo terminal hands over later what is written: a busy computer takes its time.
                assert until(lambda: b"".join(queued) == b"".join(sent))
                signal.raise_signal(getattr(signal, end))
            write(recorder, chunk)

        def counted(queue: ChunkQueue, chunk: Chunk) -> None:
            queued.append(chunk.data)
            put(queue, chunk)

        monkeypatch.setattr(ChunkQueue, "put", counted)
        monkeypatch.setattr(Recorder, "write", held_up)
        monkeypatch.setattr(live, "_identify", lambda _ports: os.write(ours, sent[0]))  # the ports are open
        where = ["--out", tmp_path / "walk.mcap"] if command == "record" else ["--headless", "--out", tmp_path]
        done = echostep(command, "--board", port, "--seconds", PATIENCE_S, *where)
    assert done.returncode == 0, done.stderr
    recorded = b"".join(chunk.data for chunk in open_recording(tmp_path / "walk.mcap").chunks())
    assert recorded == b"".join(sent)


SECOND_NS = 1_000_000_000


def test_sleep_is_noticed() -> None:
    arrival, awake = iter([100, 100, 60 * SECOND_NS, 60 * SECOND_NS, 60 * SECOND_NS]), iter([50, 50, 50, 50, 50])
    watch = SleepWatch(lambda: next(arrival), lambda: next(awake))
    assert watch.slept_s() == 0.0
    assert watch.slept_s() == pytest.approx(60.0, abs=0.1)
    assert watch.slept_s() == 0.0
    assert now_ns() <= now_ns()
