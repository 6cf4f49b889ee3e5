# SPDX-License-Identifier: MIT
"""The last lines of a run say since when nothing came, from which port, and how much of what was worn has estimates."""

from __future__ import annotations

import pytest

from echostep.localization import TrackStatus
from echostep.ports.chunks import BOARD, FOOT, MTX, Chunk, portion_of
from echostep_app.session import losses
from echostep_app.session.losses import Arrivals
from session.test_losses import Run

S = 1_000_000_000


def heard(**until_s: int) -> Arrivals:
    """One chunk a second of each port, from 100 s of the host's clock on, for so many seconds."""
    made = Arrivals()
    chunks = [Chunk(port, (100 + k) * S, b"x") for port, seconds in until_s.items() for k in range(seconds)]
    made.note(portion_of(sorted(chunks, key=lambda chunk: chunk.t_arrival_ns)))
    return made


def test_a_port_that_fell_silent_is_named_with_its_time(monkeypatch: pytest.MonkeyPatch) -> None:
    made = heard(**{BOARD: 60, FOOT: 20})
    assert made.silent() == ["nothing came from the foot board since 19 s, for the last 40 s"]
    made.urls = {BOARD: "/dev/ttyACM0", FOOT: "/dev/ttyACM1"}
    monkeypatch.setattr(losses, "now_ns", lambda: 160 * S)
    assert made.silent() == ["nothing came from the foot board (/dev/ttyACM1) since 19 s, for the last 41 s"]
    assert made.worn_s == pytest.approx(60.0)


def test_a_port_that_never_sent_is_named_and_a_whole_run_has_no_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(losses, "now_ns", lambda: 160 * S)
    made = heard(**{BOARD: 60})
    made.urls = {BOARD: "a", MTX: "b"}
    assert made.silent() == ["nothing came from the MTx (b) at all"]
    assert heard(**{BOARD: 60, MTX: 60}).silent() == []
    assert (Arrivals().worn_s, Arrivals().silent()) == (0.0, [])


def test_what_was_worn_and_has_no_estimate_is_told() -> None:
    run = Run()
    run.go(20, TrackStatus.TRACKING)
    assert run.losses.describe(22.0) == "never lost in 19 s"
    assert run.losses.describe(60.0) == "never lost in 19 s; 41 s of the 60 s that were worn have no estimate"
