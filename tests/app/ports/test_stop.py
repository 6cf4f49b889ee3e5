# SPDX-License-Identifier: MIT
"""The end of a live run loses nothing that had arrived: neither what waits in the queue nor what the operating system holds."""

from __future__ import annotations

import os
import signal
from pathlib import Path
from typing import Any

import pytest

from command_line import echostep
from echostep.ports.chunks import Chunk
from echostep.recording import open_recording
from echostep_app.ports.serial_ports import ChunkQueue, SerialPorts
from echostep_app.recording.recorder import Recorder
from echostep_app.session.runs import live
from players import pseudo_terminal
from waiting import PATIENCE_S, until


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
