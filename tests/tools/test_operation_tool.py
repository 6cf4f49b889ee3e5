# SPDX-License-Identifier: MIT
"""What `make operation` prints and when it fails; the operation itself takes minutes and is run by hand."""

from __future__ import annotations

import pytest

from reliability.team_operation import judge

ARRIVED = {"cue": "fallen is here", "kind": "arrived"}
SENT = ["x: 5 of 5 reports sent, 0 overtaken by newer ones, 0 unsent, 0 heartbeats, connection broken 0 times"]


def members(*states: str) -> dict[str, list[dict[str, object]]]:
    return {"members": [{"name": f"n{k}", "state": state, "missed": 0} for k, state in enumerate(states)]}


def test_an_operation_in_which_everything_happened(capsys: pytest.CaptureFixture[str]) -> None:
    assert judge(members("mayday", "lost", "tracking"), SENT, 31.0, ARRIVED, 3, 60.0)
    assert "NOT" not in capsys.readouterr().out


@pytest.mark.parametrize(
    ("states", "told_s", "arrived", "sent"),
    [
        (("mayday", "lost"), 31.0, ARRIVED, SENT),
        (("lost", "mayday", "tracking"), 31.0, ARRIVED, SENT),
        (("mayday", "lost", "tracking"), 36.0, ARRIVED, SENT),
        (("mayday", "lost", "tracking"), None, ARRIVED, SENT),
        (("mayday", "lost", "tracking"), 31.0, {"cue": "Stop", "kind": "stop"}, SENT),
        (("mayday", "lost", "tracking"), 31.0, ARRIVED, ["x: 4 of 5 reports sent, 0 overtaken, 1 unsent"]),
    ],
)
def test_what_did_not_happen_is_named(
    capsys: pytest.CaptureFixture[str], states: tuple[str, ...], told_s: float | None,
    arrived: dict[str, str], sent: list[str],
) -> None:  # fmt: skip
    assert not judge(members(*states), sent, told_s, arrived, 3, 60.0)
    assert capsys.readouterr().out.count("NOT ") == 1
