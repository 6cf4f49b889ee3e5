# SPDX-License-Identifier: MIT
"""`echostep live` and `record` with a simulated MTx on a pseudo terminal: set up from any state, explained when it cannot be."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path

import pytest

from board_runs import ROOT
from command_line import echostep, interrupt_once_called, interrupt_when
from echostep.ports.chunks import Chunk
from echostep.recording import open_recording
from echostep.xsens import PROJECT, MtxReader, OutputFormat
from echostep_app.xsens.startup import MtxStart
from echostep_studies.simulation.devices.mtx_setup import FACTORY, MtxDevice
from players import pseudo_terminal
from waiting import PATIENCE_S
from xsens.mt_lines import on_a_terminal

PLAN = ROOT / "host/core/echostep/plans/demo.json"


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


@pytest.mark.slow
def test_live_stops_at_a_device_that_is_set_wrongly_and_does_not_listen(tmp_path: Path) -> None:
    with on_a_terminal(MtxDevice(FACTORY, deaf=True)) as mtx, mute_port() as board:
        done = echostep(
            "live",
            "--plan",
            PLAN,
            "--board",
            board,
            "--mtx",
            mtx,
            "--out",
            tmp_path,
            "--headless",
            "--seconds",
            PATIENCE_S,
        )
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
        done = echostep(
            "live", "--plan", PLAN, "--board", board, "--mtx", mtx, "--out", tmp_path, "--settings", tmp_path / "s.toml", "--headless"
        )  # fmt: skip
    assert done.returncode == 2
    assert "rate_hz" in done.stderr
