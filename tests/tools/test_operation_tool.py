# SPDX-License-Identifier: MIT
"""What `make operation` prints, when it fails, and a small one with its page; the whole one takes minutes and is run by hand."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Any

import pytest

from board_runs import tool
from free_ports import free_port
from page.browser import DESK, loaded_page, wait_for
from page.web.test_page_sizes import TABLE_READY
from reliability.operation_crews import crews_written
from reliability.team_operation import judge
from team.team_broker import needs_broker

ARRIVED = {"cue": "fallen is here", "kind": "arrived"}
SENT = ["x: 5 of 5 reports sent, 0 overtaken by newer ones, 0 unsent, 0 heartbeats, connection broken 0 times"]
CREWS = {"Attack 1": ["entered"], "Attack 2": ["entered"], "Rescue": ["entered", "checked"]}


def members(*states: str) -> dict[str, list[dict[str, object]]]:
    return {"members": [{"name": f"n{k}", "state": state, "missed": 0} for k, state in enumerate(states)]}


def test_an_operation_in_which_everything_happened(capsys: pytest.CaptureFixture[str]) -> None:
    assert judge(members("mayday", "lost", "tracking"), SENT, 31.0, ARRIVED, CREWS, 3, 60.0)
    assert "NOT" not in capsys.readouterr().out


@pytest.mark.parametrize(
    ("states", "told_s", "arrived", "sent", "crews"),
    [
        (("mayday", "lost"), 31.0, ARRIVED, SENT, CREWS),
        (("lost", "mayday", "tracking"), 31.0, ARRIVED, SENT, CREWS),
        (("mayday", "lost", "tracking"), 36.0, ARRIVED, SENT, CREWS),
        (("mayday", "lost", "tracking"), None, ARRIVED, SENT, CREWS),
        (("mayday", "lost", "tracking"), 31.0, {"cue": "Stop", "kind": "stop"}, SENT, CREWS),
        (("mayday", "lost", "tracking"), 31.0, ARRIVED, ["x: 4 of 5 reports sent, 0 overtaken, 1 unsent"], CREWS),
        (("mayday", "lost", "tracking"), 31.0, ARRIVED, SENT, {}),
        (("mayday", "lost", "tracking"), 31.0, ARRIVED, SENT, CREWS | {"Rescue": ["entered"]}),
    ],
)
def test_what_did_not_happen_is_named(
    capsys: pytest.CaptureFixture[str], states: tuple[str, ...], told_s: float | None,
    arrived: dict[str, str], sent: list[str], crews: dict[str, list[str]],
) -> None:  # fmt: skip
    assert not judge(members(*states), sent, told_s, arrived, crews, 3, 60.0)
    assert capsys.readouterr().out.count("NOT ") == 1


@needs_broker
@pytest.mark.process
@pytest.mark.long
def test_a_small_operation_has_a_page_with_crews_at_the_address_that_it_prints(browser: Any, tmp_path: Path) -> None:
    port = free_port()
    options = ("--wearers", "4", "--firmware", "0", "--speed", "6", "--port", str(port), "--out", str(tmp_path))
    running = subprocess.Popen([*tool("reliability.team_operation"), *options], stdout=subprocess.PIPE, text=True)
    try:
        assert running.stdout
        address = next(line for line in running.stdout if line.startswith("The commander's page")).split()[-1]
        assert address.startswith(f"http://127.0.0.1:{port}/")
        page = loaded_page(browser, address, DESK, TABLE_READY)
        wait_for(page, "document.querySelector('#crews-button').textContent === 'Crews 3 !'")
        wait_for(page, "document.querySelector('#crew-due').textContent === 'Attack 2: check due'")
        wait_for(page, "document.querySelector('#list li').innerText.includes('fallen')")
        assert not page.wrong
        page.context.close()
        said = running.stdout.read()
        assert running.wait() == 0, said
    finally:
        running.kill()
        running.communicate()
    assert "NOT" not in said
    assert "echostep command " in said
    (table,) = tmp_path.glob("*-crews.csv")
    assert crews_written(table) == CREWS
