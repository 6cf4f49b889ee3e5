# SPDX-License-Identifier: MIT
"""Configuration of an MTx: from any state to the project's mode, over lines that lose and damage; `live` and `record` set it up and explain."""

from __future__ import annotations

import contextlib
import struct
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from command_line import echostep, interrupt_once_called, interrupt_when
from echostep.ports.chunks import Chunk
from echostep.recording import open_recording
from echostep.xsens import PROJECT, MtxReader, OutputFormat, encode_frame
from echostep.xsens.frames import FrameReader
from echostep_app.xsens.requests import project_requests, set_rate
from echostep_app.xsens.setup import FIRST_TRIES, TIMEOUT_S, MtxSetup, State
from echostep_app.xsens.startup import MtxStart
from echostep_studies.simulation.devices.mtx_setup import FACTORY, DeviceState, MtxDevice
from players import pseudo_terminal
from waiting import PATIENCE_S
from walks import DEMO as PLAN
from xsens.mt_lines import SAMPLE, STEP_S, Line, on_a_terminal


@pytest.mark.parametrize("state", list(DeviceState))
@pytest.mark.parametrize("output", [FACTORY, PROJECT, OutputFormat(0x4000, 0), OutputFormat(0x0007, 0x0101)])
def test_from_any_state_to_the_projects_mode(state: DeviceState, output: OutputFormat) -> None:
    made = MtxDevice(output)
    made.state, made.period, made.skip = state, 2304, 3
    line = Line(made)
    assert line.run(1.5).state is State.CONFIGURED, line.setup.verdict
    assert (made.output, made.rate_hz, made.pulses) == (PROJECT, 100.0, True)
    assert (made.sync_out[0], made.sync_out[1], made.sync_out[2], made.sync_out[3]) == (0x12, 0, 0, 29_491)
    assert made.state is DeviceState.MEASURING
    assert MtxReader().feed(line.received)[-1].accel == SAMPLE.accel
    assert line.setup.verdict == "MTx: configured: MTx-28A53G25, firmware 2.8.1"


def test_a_device_that_just_woke_is_caught_within_its_half_second() -> None:
    """At first, and again later."""
    made = MtxDevice()
    line = Line(made)
    for wake_ups in (1, 2):
        made.output = FACTORY
        line._to_host = made.power_on(line.now_s)
        assert line.run(0.4).state is State.CONFIGURED
        assert (line.setup.wake_ups, made.output) == (wake_ups, PROJECT)


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10_000))
def test_lost_messages_are_asked_again(seed: int) -> None:
    line = Line(MtxDevice(), lose=0.2, seed=seed)
    line.run(20.0)
    assert line.setup.finished
    if line.setup.state is State.CONFIGURED and not line.setup.remarks:
        assert (line.device.output, line.device.rate_hz, line.device.pulses) == (PROJECT, 100.0, True)


@settings(max_examples=50, deadline=None)
@given(st.binary(max_size=400), st.integers(0, 3))
def test_noise_neither_raises_nor_blocks(noise: bytes, where: int) -> None:
    setup = MtxSetup(project_requests(100.0), 100.0)
    frames = [noise, encode_frame(0x42, noise[:3]), encode_frame(0x3E) * 30, encode_frame(0x31, noise[:9])]
    now_s = 0.0
    for _ in range(2_000):
        setup.advance(frames[where], now_s)
        now_s += 0.1
        if setup.finished:
            break
    else:
        pytest.fail("it never came to an end")


def test_silence_ends_after_its_tries_and_is_said() -> None:
    setup = MtxSetup(project_requests(100.0), 100.0)
    sent, now_s = [], 0.0
    while not setup.finished and now_s < 10.0:
        sent.append(setup.advance(b"", now_s))
        now_s += STEP_S
    assert [part for part in sent if part] == [encode_frame(0x30)] * FIRST_TRIES
    assert now_s == pytest.approx(FIRST_TRIES * TIMEOUT_S, abs=0.05)
    assert setup.state is State.SILENT
    assert "silent" in setup.verdict


def packet(identifier: int, layout: str, *values: float) -> bytes:
    return struct.pack(">HB", identifier, struct.calcsize(">" + layout)) + struct.pack(">" + layout, *values)


OUTPUTS = {  # of an MTi of the 600 series: as it is sold; increments only; everything that is needed
    "euler": (packet(0x2030, "3f", 0.1, 0.2, 3.0), packet(0xE020, "I", 0)),
    "sdi": (packet(0x4010, "3f", 0, 0, 0.1), packet(0x8030, "4f", 1, 0, 0, 0)),
    "full": (packet(0x2010, "4f", 1, 0, 0, 0), packet(0x4020, "3f", 0, 0, 9.81), packet(0x8020, "3f", 0, 0, 0)),
}


def mti(outputs: str, seconds: float, answers_s: float = 1e9) -> MtxSetup:
    """A setup that hears so many seconds of an MTi, which answers the first request after `answers_s`."""
    setup, asked = MtxSetup(project_requests(100.0), 100.0), False
    for k in range(round(seconds / STEP_S)):
        received = encode_frame(0x36, b"".join([packet(0x1020, "H", k & 0xFFFF), *OUTPUTS[outputs]]))
        if asked and k * STEP_S >= answers_s:
            received += encode_frame(0x31)
            answers_s = 1e9
        asked = bool(setup.advance(received, k * STEP_S)) or asked
    return setup


@pytest.mark.parametrize("outputs", ["euler", "sdi"])
def test_a_stream_without_a_usable_sample_is_not_the_wanted_one(outputs: str) -> None:
    setup = mti(outputs, 2.0)
    assert setup.state is State.WRONG_MODE
    assert (
        "sends MTData2 without acceleration and rate of turn. Check the line from host to MTx (its RX)" in setup.verdict
    )
    assert "MT Manager" in setup.verdict


def test_a_deaf_device_that_sends_what_is_needed_is_used_and_asked_again_until_it_answers() -> None:
    assert mti("full", 2.0).state is State.UNANSWERED
    assert mti("euler", 1.4, answers_s=1.3).state is State.BUSY  # the sixth request is answered: the setup goes on
    again = mti("full", 3.1, answers_s=3.0)
    assert again.state is State.BUSY  # begun again with the first answer
    assert mti("full", 3.0, answers_s=3.0).state is State.UNANSWERED


def test_a_device_that_hears_nothing_but_streams_the_right_mode_is_taken() -> None:
    setup = Line(MtxDevice(PROJECT, deaf=True)).run(2.0)
    assert setup.state is State.UNANSWERED
    assert "used as it is" in setup.verdict


@pytest.mark.parametrize(
    ("output", "period", "said"), [(FACTORY, 1152, "18 bytes instead of 54"), (PROJECT, 2304, "50 Hz")]
)
def test_a_device_that_hears_nothing_in_a_wrong_mode_is_explained(output: OutputFormat, period: int, said: str) -> None:
    line = Line(MtxDevice(output, deaf=True))
    for _ in range(200):
        line.run(STEP_S)
        if period == 2304 and line.counter % 2:
            line._to_host = b""
    assert line.setup.state is State.WRONG_MODE
    assert said in line.setup.verdict
    assert "MT Manager" in line.setup.verdict
    assert "\n" not in line.setup.verdict


def test_bytes_that_are_no_frames_hint_at_the_rate_of_the_line() -> None:
    setup = MtxSetup(project_requests(100.0), 100.0)
    for k in range(200):
        setup.advance(b"\x55\x01\x80", k * STEP_S)
    assert setup.state is State.SILENT
    assert "115200 Bd" in setup.verdict


class WithoutSync(MtxDevice):
    def _sync(self, payload: bytes) -> bytes:
        raise ValueError(payload)


class Stubborn(MtxDevice):
    """Acknowledges a mode and keeps its own."""

    def _set_or_tell(self, mid: int, payload: bytes) -> bytes:
        return b"" if mid == 0xD0 and payload else super()._set_or_tell(mid, payload)


def test_a_device_that_answers_too_late_is_told_from_a_deaf_one() -> None:
    """It answers each request after 1.2 s: the line works, and what to do is said."""
    setup, reader, answers = MtxSetup(project_requests(100.0), 100.0), FrameReader(), list[tuple[float, bytes]]()
    for now_s in (k * STEP_S for k in range(round(8.0 / STEP_S))):
        due = b"".join(answer for due_s, answer in answers if due_s <= now_s)
        answers = [(due_s, answer) for due_s, answer in answers if due_s > now_s]
        for frame in reader.feed(setup.advance(due, now_s)):
            answers.append((now_s + 1.2, encode_frame(frame.mid + 1)))
    assert setup.state is State.WRONG_MODE
    assert "within 1 s. Take its supply away, give it again and start once more, or set it once" in setup.verdict
    assert "line from host" not in setup.verdict


def test_sync_out_is_wanted_but_not_needed() -> None:
    setup = Line(WithoutSync()).run(1.5)
    assert setup.state is State.CONFIGURED
    assert "SetSyncOutSettings mode refused: error 0x21, invalid parameter" in setup.verdict


def test_a_mode_that_was_not_taken_is_noticed() -> None:
    line = Line(Stubborn())
    assert line.run(1.5).state is State.WRONG_MODE
    assert "ReqOutputMode" in line.setup.verdict
    assert line.device.state is DeviceState.MEASURING


@pytest.mark.parametrize(
    ("rate_hz", "period", "skip"), [(100.0, 1152, 0), (50.0, 2304, 0), (120.0, 960, 0), (5.0, 11_520, 1)]
)
def test_rates(rate_hz: float, period: int, skip: int) -> None:
    first, second = set_rate(rate_hz)
    assert (first.payload, second.payload) == (period.to_bytes(2, "big"), skip.to_bytes(2, "big"))


def test_messages_are_the_ones_of_the_manual() -> None:
    frames = {request.name: encode_frame(request.mid, request.payload).hex() for request in project_requests(100.0)}
    assert frames["ReqOutputMode"] == "faffd00031"  # MT0100P.N, 5.3.2
    assert frames["SetOutputMode"] == "faffd00200 0629".replace(" ", "")
    assert encode_frame(0x10).hex() == "faff1000f1"


def test_what_waited_in_the_system_is_no_rate() -> None:
    """A hundred frames at once, then 100 Hz: the right mode."""
    setup = MtxSetup(project_requests(100.0), 100.0)
    made = MtxDevice(PROJECT)
    waiting = b"".join(made.measure(SAMPLE._replace(counter=n)) for n in range(100))
    setup.advance(waiting, 1.0)
    for k in range(200):
        setup.advance(made.measure(SAMPLE._replace(counter=100 + k)), 1.01 + k * STEP_S)
    assert setup.state is State.UNANSWERED


@contextlib.contextmanager
def mute_port() -> Iterator[str]:
    """A board that says nothing."""
    with pseudo_terminal() as (_, port):
        yield port


@pytest.mark.parametrize("output", [FACTORY, PROJECT])
def test_record_sets_the_device_up_and_keeps_every_byte(
    tmp_path: Path, output: OutputFormat, monkeypatch: pytest.MonkeyPatch
) -> None:
    device, measured = MtxDevice(output), list[bytes]()
    device.period = 2304

    def has_measured(chunk: Chunk) -> bool:
        """Whether a tenth of a second and more has come in the wanted format."""
        measured.append(chunk.data)
        return device.output == PROJECT and len(MtxReader().feed_batch(b"".join(measured)).counter) > 20

    monkeypatch.setattr("echostep_app.xsens.setup.TIMEOUT_S", 10.0)  # the device shares this process
    interrupt_when(has_measured, monkeypatch)
    with on_a_terminal(device) as mtx, mute_port() as board:
        done = echostep("record", "--board", board, "--mtx", mtx, "--out", tmp_path / "r.mcap", "--seconds", PATIENCE_S)
    assert done.returncode == 0, done.stderr
    assert "MTx: configured" in done.stdout
    assert (device.output, device.rate_hz, device.pulses) == (PROJECT, 100.0, True)
    stream = b"".join(c.data for c in open_recording(tmp_path / "r.mcap").chunks() if c.port == "mtx")
    reader = MtxReader()
    assert len(reader.feed_batch(stream).counter) > 20
    assert reader.counts.bad_checksum == 0
    assert bytes.fromhex("faff3100d0") in stream  # the acknowledgements are in the recording, too


def live(board: str, mtx: str, out: Path, *more: object) -> subprocess.CompletedProcess[str]:
    ports = ("--board", board, "--mtx", mtx)
    return echostep("live", "--plan", PLAN, *ports, "--out", out, "--headless", *more)


@pytest.mark.slow
def test_live_stops_at_a_device_that_is_set_wrongly_and_does_not_listen(tmp_path: Path) -> None:
    with on_a_terminal(MtxDevice(FACTORY, deaf=True)) as mtx, mute_port() as board:
        done = live(board, mtx, tmp_path, "--seconds", PATIENCE_S)
    assert done.returncode == 2
    assert "MTData of 18 bytes instead of 54" in done.stderr
    assert "MT Manager" in done.stderr
    assert "Traceback" not in done.stderr
    assert (tmp_path / "walk.mcap").stat().st_size > 1_000


@pytest.mark.slow
@pytest.mark.parametrize("output", [PROJECT, None])
def test_record_goes_on_with_a_device_that_is_right_or_silent(
    tmp_path: Path, output: OutputFormat | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    interrupt_once_called(MtxStart, "_report_result", monkeypatch)
    with on_a_terminal(MtxDevice(output, deaf=True)) if output else mute_port() as mtx, mute_port() as board:
        done = echostep("record", "--board", board, "--mtx", mtx, "--out", tmp_path / "r.mcap", "--seconds", PATIENCE_S)
    assert done.returncode == 0, done.stderr
    assert ("does not answer, but sends what is needed" if output else "MTx: silent") in done.stdout


def test_a_rate_that_the_device_cannot_have_is_named(tmp_path: Path) -> None:
    (tmp_path / "s.toml").write_text("[mtx]\nrate_hz = 99.9\n")
    with mute_port() as mtx, mute_port() as board:
        done = live(board, mtx, tmp_path, "--settings", tmp_path / "s.toml")
    assert done.returncode == 2
    assert "rate_hz" in done.stderr
