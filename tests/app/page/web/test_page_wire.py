# SPDX-License-Identifier: MIT
"""What goes to a page is JSON whatever the plan is; what fails on the server is said, in the log and to the page."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from echostep.plan import Plan
from echostep_app.page import protocol
from echostep_app.page.elements.echo_lines import EchoLine
from echostep_app.page.mailbox import Mailbox
from page.frames import PLAN, fetched, lines_of, next_frame, opened, scene, served
from plan.imported_plans import seven_floors
from waiting import PATIENCE_S


@pytest.mark.parametrize("plan", [PLAN, seven_floors()], ids=["demo", "seven floors"])
def test_a_page_of_any_plan_gets_hello_lines_and_frames(plan: Plan) -> None:
    """An outline is an array, and an array is no JSON: the imported plan's page stayed dark."""
    with served(Mailbox(plan, "test", replay=False)) as (server, mailbox):
        mailbox.publish(scene())
        with opened(server) as page:
            hello = json.loads(page.recv(timeout=PATIENCE_S))
            frame = next_frame(page)
        for k, level in enumerate(plan.levels):
            lines = lines_of(server.url, k)
            assert len(lines["wall"]) == len(level.solid) - len(level.windows)
            assert np.array_equal(lines["wall"][: len(level.walls)], level.walls.astype("<f4"))
            assert len(lines["unknown"]) == len(level.doors)  # both plans say of no door whether it is open
        assert not server.shared.faults.notices
    rooms = [[room["name"] for room in level["rooms"]] for level in hello["plan"]["levels"]]
    assert rooms == [[room.name for room in level.rooms] for level in plan.levels]
    assert frame["told"]["where"]


def test_numbers_of_numpy_and_numbers_that_are_none() -> None:
    line = EchoLine(1.0, 0, float(np.float64(2.0)), np.float32(0.5), math.nan, math.inf, None)  # type: ignore[arg-type]
    sent = protocol.frame(replace(scene(), echo_lines=(line,)), protocol.FrameParts(1))
    length = int.from_bytes(sent[:4], "little")

    def never(constant: str) -> None:
        raise AssertionError(f"{constant} is not JSON")

    header = json.loads(sent[4 : 4 + length], parse_constant=never)
    assert header["beams"] == [
        {"t_s": 1.0, "ranger": 0, "x_m": 2.0, "y_m": 0.5, "axis_rad": None, "measured_m": None, "expected_m": None}
    ]


def test_an_array_is_refused_where_it_is_encoded() -> None:
    with pytest.raises(TypeError, match="ndarray in a message to the page"):
        protocol.encode(protocol.Refused(np.zeros(2)))  # type: ignore[arg-type]


def test_a_fault_reaches_the_log_once_and_every_page_in_words(monkeypatch: pytest.MonkeyPatch) -> None:
    with served() as (server, mailbox):
        monkeypatch.setattr(protocol, "hello", broken)
        for _ in range(3):
            with opened(server) as page:
                told = json.loads(page.recv(timeout=PATIENCE_S))
                assert told["kind"] == "failed"
                assert "ZeroDivisionError: division by zero" in told["reason"]
        assert len(server.shared.faults.notices) == 1
        assert "ZeroDivisionError" in server.shared.faults.notices[0]
        assert "test_page_wire.py, line" in server.shared.faults.notices[0]
        assert server.shared.faults.notices[0].endswith("the run goes on, and so does the page.")
        monkeypatch.undo()
        mailbox.publish(scene())
        with opened(server) as page:
            assert json.loads(page.recv(timeout=PATIENCE_S))["kind"] == "hello"


def test_the_end_of_the_servers_thread_is_told_and_no_traceback() -> None:
    with served() as (server, _):
        server._server.run = broken  # type: ignore[method-assign]
        server._serve()
        (notice,) = server.shared.faults.notices
    assert notice.startswith("The page is no longer served: ZeroDivisionError: division by zero")
    assert notice.endswith("The run goes on without it.")


def broken(*_: object, **__: object) -> None:
    1 / 0  # noqa: B018


def test_a_fault_in_a_frame_and_in_the_lines(monkeypatch: pytest.MonkeyPatch) -> None:
    with served() as (server, mailbox):
        monkeypatch.setattr(protocol, "frame", broken)
        monkeypatch.setattr(protocol, "lines", broken)
        mailbox.publish(scene())
        with opened(server) as page:
            assert json.loads(page.recv(timeout=PATIENCE_S))["kind"] == "hello"
            assert json.loads(page.recv(timeout=PATIENCE_S))["kind"] == "failed"
        refused = fetched(f"{server.url}lines/0")
        assert refused.status == 500
        assert b"ZeroDivisionError" in refused.body
        assert len(server.shared.faults.notices) == 1  # the same line of code
