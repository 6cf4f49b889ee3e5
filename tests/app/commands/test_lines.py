# SPDX-License-Identifier: MIT
"""`--foot lines:PORT`: a foot IMU that prints lines, over each kind of port; any split gives the same samples, garbage is counted."""

from __future__ import annotations

import json
import os
import re
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from itertools import islice
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from board_runs import ROOT
from command_line import PROGRAM
from command_line import echostep as run
from echostep.errors import EchostepError
from echostep.ports.chunks import LINES, MTX
from echostep.recording import open_recording
from echostep.xsens import MtxReader
from echostep_app.offline.foot_files import load_foot
from echostep_app.ports.serial_ports import SerialPorts
from echostep_app.ports.udp import BYTES_A_SECOND
from echostep_app.session.runs import line_foot
from echostep_app.session.runs.line_foot import LineFoot, port_of
from echostep_app.session.runs.live_lines import LONGEST_LINE, LineChunks, LineReader
from foot.foot_walks import walking
from free_ports import free_port
from players import playing, pseudo_terminal
from waiting import ran, until

HEADER = "t_s,ax,ay,az,gx,gy,gz"
DEVICE = """
import sys, time
began_s = time.monotonic()
for line in open(sys.argv[1]):
    time.sleep(max(0.0, float(line.split(",")[0].replace("t_s", "0")) - (time.monotonic() - began_s)))
    print(line, end="", flush=True)
"""


@pytest.fixture(scope="module")
def walk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The file of a simulated walk of two steps, without most of the time that the foot stands."""
    file = tmp_path_factory.mktemp("lines") / "imu.csv"
    t_s, accel, gyro = walking(2)
    kept = (t_s > 1.5) & (t_s < t_s[-1] - 1.5)
    np.savetxt(file, np.column_stack([t_s, accel, gyro])[kept], delimiter=",", header=HEADER, comments="", fmt="%.9g")
    return file


def lines(path: Path) -> list[str]:
    """What a device prints: samples, and each second the names of the columns."""
    imu = load_foot(path)
    samples = np.column_stack([np.round(imu.t_s - imu.t_s[0], 6), imu.accel, imu.gyro]).tolist()
    named = {int(np.searchsorted(imu.t_s - imu.t_s[0], second)) for second in range(int(np.ptp(imu.t_s)) + 1)}
    printed = [[HEADER] * (k in named) + [",".join(f"{x:.6g}" for x in each)] for k, each in enumerate(samples)]
    return [line for each in printed for line in each]


@contextmanager
def terminal() -> Iterator[tuple[str, Callable[[bytes], object]]]:
    with pseudo_terminal() as (ours, port):
        os.set_blocking(ours, True)
        yield port, lambda line: os.write(ours, line)


@contextmanager
def tcp() -> Iterator[tuple[str, Callable[[bytes], object]]]:
    with socket.create_server(("127.0.0.1", 0)) as server:
        taken: list[socket.socket] = []

        def send(line: bytes) -> None:
            if not taken:
                taken.append(server.accept()[0])
            taken[0].sendall(line)

        yield f"tcp://127.0.0.1:{server.getsockname()[1]}", send
        for each in taken:
            each.close()


@contextmanager
def udp() -> Iterator[tuple[str, Callable[[bytes], object]]]:
    port = free_port(socket.SOCK_DGRAM)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        yield f"udp://127.0.0.1:{port}", lambda line: sender.sendto(line.rstrip(), ("127.0.0.1", port))


@pytest.mark.parametrize("kind", [terminal, tcp, udp])
def test_each_kind_of_port_gives_the_samples(kind: Callable[[], object], walk: Path) -> None:
    """The columns are named behind the port, as for a device that prints samples alone."""
    sent = [line.encode() + b"\n" for line in lines(walk) if line != HEADER]
    pace_s = max(map(len, sent)) / (0.8 * BYTES_A_SECOND) if kind is udp else 0.0005  # of datagrams no more are taken
    with kind() as (port, send):  # type: ignore[attr-defined]
        foot = f"lines:{port}#{HEADER}"
        with closing(SerialPorts({LINES: str(port_of(foot))}, {LINES: 115200})) as ports:
            coming = iter(sent)

            def play() -> None:
                time.sleep(pace_s)
                for line in islice(coming, 1):
                    send(line)

            with playing(play):
                found = LineFoot(ports, foot)
                reader, heard = MtxReader(), []
                for chunk in found.with_samples(ports.chunks()):
                    if chunk is not None and chunk.port == MTX:
                        heard.extend(reader.feed(chunk.data))
                    if len(heard) == len(sent):
                        ports.stop()
    imu = load_foot(walk)
    assert found.rate_hz == pytest.approx(100.0, rel=1e-3)
    assert np.allclose([sample.accel for sample in heard], imu.accel, rtol=1e-5, atol=1e-5)
    assert ports.urls[LINES].startswith(("/", "socket:", "udp:"))


@pytest.mark.process
@pytest.mark.slow
def test_a_live_run_without_a_board_is_replayed_bit_for_bit(walk: Path, tmp_path: Path) -> None:
    plan = tmp_path / "plan.json"
    walls = [[-9, -9, 9, -9], [9, -9, 9, 40], [9, 40, -9, 40], [-9, 40, -9, -9]]
    plan.write_text(json.dumps({"echostep_plan": 1, "name": "Hall", "levels": [{"name": "0", "walls": walls}]}))
    live = ("live", "--foot", "lines:-", "--plan", plan, "--start", "1,2,90", "--headless", "--out", tmp_path)
    (tmp_path / "lines.csv").write_text("".join(f"{line}\n" for line in lines(walk)))
    device_command = [sys.executable, "-c", DEVICE, str(tmp_path / "lines.csv")]
    with subprocess.Popen(device_command, stdout=subprocess.PIPE) as device:
        done = ran([*PROGRAM, *map(str, live)], stdin=device.stdout)
    assert done.returncode == 0, done.stderr
    assert "foot in lines: 100 Hz; 0 lines were no sample" in done.stdout
    again = run("replay", tmp_path / "walk.mcap", "--plan", plan, "--headless", "--out", tmp_path / "again")
    assert again.returncode == 0, again.stderr
    assert (tmp_path / "again/track.csv").read_bytes() == (tmp_path / "track.csv").read_bytes()
    text = b"".join(chunk.data for chunk in open_recording(tmp_path / "walk.mcap").chunks() if chunk.port == LINES)
    assert text.decode().split("\n")[:-1] == lines(walk)


@pytest.mark.parametrize(
    ("sent", "said"),
    [
        (b"", r"no line named the columns \(print t_s,ax,ay,az,gx,gy,gz each second"),
        (b"hello\n" + HEADER.encode() + b"\n1,2\n", "in 1 s 0 samples came; 2 lines were no sample"),
        (
            HEADER.encode()
            + b"\n"
            + b"".join(b"%d,0,0.%d,1,0.1%d,.2%d,.3%d\n" % (k * 10, k % 7, k, k, k) for k in range(300)),
            "is it in milliseconds.*units go into the header, as t",
        ),
    ],
)
def test_what_is_no_foot_is_said(sent: bytes, said: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(line_foot, "PATIENCE_S", 1.0)
    with terminal() as (port, send), closing(SerialPorts({LINES: port}, {LINES: 115200})) as ports:
        send(sent)
        assert until(lambda: sum(len(chunk.data) for chunk in ports._queue._chunks) == len(sent))
        with pytest.raises(EchostepError, match=said):
            LineFoot(ports, f"lines:{port}")


TEXT = (
    b"boot 1.2\r\nt (ms),ax (g),ay (g),az (g),gx (deg/s),gy (deg/s),gz (deg/s)\r\n0,0,0,1,180,0,0\r\n10,1,0,0,0,0,0\n"
)


def test_the_header_gives_names_and_units() -> None:
    reader = LineReader()
    samples = reader.feed(TEXT)
    assert np.allclose(samples, [[0, 0, 0, 9.80665, np.pi, 0, 0], [0.01, 9.80665, 0, 0, 0, 0, 0]])
    assert reader.unreadable == 1


@given(st.lists(st.integers(0, len(TEXT)), max_size=5).map(sorted))
def test_any_split_gives_the_same_samples(cuts: list[int]) -> None:
    reader, edges = LineReader(), [0, *cuts, len(TEXT)]
    parts = [reader.feed(TEXT[begin:end]) for begin, end in zip(edges, edges[1:], strict=False)]
    assert np.array_equal(np.concatenate(parts), LineReader().feed(TEXT))


@given(st.binary(max_size=200))
def test_garbage_costs_its_own_lines_and_is_counted(garbage: bytes) -> None:
    reader = LineReader()
    reader.feed(TEXT + garbage + b"\n")
    assert len(reader.feed(b"20,1,0,0,0,0,0\n")) == 1


def test_what_is_no_sample_is_counted() -> None:
    reader = LineReader()
    reader.feed(b"1,2,3,4,5,6,7\n" + TEXT)  # before the names
    bad = (
        b"20,nan,0,0,0,0,0\n",
        b"30,1\n",
        b"1e18,1,0,0,0,0,0\n",
        b"40,1,0,0,0,0,0,8\n",
        b"9" * 3 * LONGEST_LINE + b"\n",
    )
    assert sum(len(reader.feed(line)) for line in bad) == 0
    assert reader.unreadable == 2 + len(bad)


def test_a_datagram_needs_no_line_end() -> None:
    reader = LineReader()
    reader.feed(TEXT)
    assert len(reader.feed(b"\x0020,1,0,0,0,0,0\0\x0030,1,0,0,0,0,0\0")) == 2


def test_the_sketch_of_the_manual_prints_what_is_read() -> None:
    printed = re.findall(r'print[f]?\("(.*?)\\n"', (ROOT / "host/docs/foot.md").read_text())
    assert len(printed) == 2
    reader = LineReader()
    samples = reader.feed("\n".join([printed[0], printed[1] % (1.5, 1, 2, 9.8, 0.1, 0.2, 0.3), ""]).encode())
    assert np.allclose(samples, [[1.5, 1, 2, 9.8, 0.1, 0.2, 0.3]])


ROW = [0.0, 0.0, 9.81, 0.1, 0.0, 0.0]


def made_of(times: list[tuple[float, int]]) -> tuple[LineChunks, list[int], list[int]]:
    """What becomes of samples at times of the device (s) that arrive at others (ns): times of the chunks, counters of the samples."""
    chunks, reader = LineChunks(100.0), MtxReader()
    made = [chunk for t_s, ns in times for chunk in chunks.of(np.array([[t_s, *ROW]]), ns)]
    assert {chunk.port for chunk in made} == {MTX}
    counters = reader.feed_batch(b"".join(chunk.data for chunk in made)).counter.tolist()
    return chunks, [chunk.t_arrival_ns for chunk in made], counters


def test_a_clock_that_is_set_goes_on_by_the_arrivals() -> None:
    """A device that restarts after a second, with the host's clock 0.5 s on; one sample comes twice and is left out."""
    after = [(0.0, 1_490_000_000), (0.01, 1_500_000_000)]
    chunks, arrivals, counters = made_of([(10.0, 0), (10.99, 990_000_000), (10.99, 995_000_000), *after])
    assert arrivals == [0, 995_000_000, 1_500_000_000, 1_500_000_000]
    assert counters == [0, 99, 149, 150]
    assert (chunks.jumps, chunks.left_out, chunks.off) == (1, 1, 0)


@pytest.mark.parametrize("wrong_s", [1.0, -1.0, 5.0])
def test_a_single_time_out_of_line_costs_its_own_sample(wrong_s: float) -> None:
    times = [(0.01 * k + wrong_s * (k == 5), 10_000_000 * k) for k in range(9)]
    chunks, _, counters = made_of(times)
    assert counters == [0, 1, 2, 3, 4, 6, 7, 8]
    assert (chunks.jumps, chunks.left_out, chunks.off) == (0, 0, 1)


@pytest.mark.parametrize("period_s", [2**32 * 1e-6, 2**16 * 1e-3])
def test_a_counter_that_wraps_goes_on(period_s: float) -> None:
    chunks, _, counters = made_of([((0.01 * k - 0.02) % period_s, 10_000_000 * k) for k in range(5)])
    assert (counters, chunks.jumps, chunks.off) == ([0, 1, 2, 3, 4], 0, 0)


def test_a_clock_of_ticks_and_a_line_of_zeros_are_read_as_in_files() -> None:
    reader = LineReader()
    sent = (
        b"SampleTimeFine,Acc_X,Acc_Y,Acc_Z,Gyr_X,Gyr_Y,Gyr_Z\n20000,1,2,3,4,5,6\n30000,0,0,0,0,0,0\n40000,1,2,3,4,5,6\n"
    )
    assert reader.feed(sent)[:, 0] == pytest.approx([0.02, 0.04])
    assert reader.unreadable == 1
