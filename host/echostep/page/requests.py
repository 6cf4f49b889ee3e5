# SPDX-License-Identifier: MIT
"""Requests of a page: texts from its WebSocket -> checked objects.

In: texts, which may be damaged or hostile. Out: requests; None for a text that is none. Owns the limits.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from echostep.plan.json_fields import LIMIT_M
from echostep.plan.routing import RoutePlace
from echostep.ports.people.check_in import MOST_LEVELS, Call, CheckIn, Undo, call_of, check_in_of, undo_of

MOST_REQUEST = 2048  # bytes
MOST_NAME = 32  # characters of a wearer's name, as in reports
FASTEST = 32.0  # times as fast as it was recorded


@dataclass(frozen=True, slots=True)
class Consider:
    """Say what a check-in would do, without making it."""

    check_in: CheckIn


@dataclass(frozen=True, slots=True)
class Met:
    """The wearer stands beside a teammate of this name."""

    name: str


@dataclass(frozen=True, slots=True)
class GoTo:
    """Guide the wearer to a place."""

    goal: RoutePlace


@dataclass(frozen=True, slots=True)
class EndGuidance:
    """End the guidance to the destination that was chosen on a page."""


@dataclass(frozen=True, slots=True)
class FrameDrawn:
    """The page has drawn frame number `seq`."""

    seq: int


@dataclass(frozen=True, slots=True)
class SetPlaying:
    """Run or pause the replay."""

    playing: bool


@dataclass(frozen=True, slots=True)
class SetSpeed:
    """Replay `times` as fast as it was recorded."""

    times: float


@dataclass(frozen=True, slots=True)
class Seek:
    """Show the moment `t_s` of the replay."""

    t_s: float


@dataclass(frozen=True, slots=True)
class StepBy:
    """Move the replay by a number of estimates; negative: back."""

    by: int


Request = (
    CheckIn | Undo | Call | Consider | Met | GoTo | EndGuidance | FrameDrawn | SetPlaying | SetSpeed | Seek | StepBy
)


def parse_request(text: str) -> Request | None:
    """The request in a text from a page; None when the text is not a valid request."""
    if len(text) > MOST_REQUEST:
        return None
    try:
        tree = json.loads(text)
    except (ValueError, RecursionError):
        return None
    return _request(tree) if isinstance(tree, dict) else None


def _request(tree: dict[str, Any]) -> Request | None:
    kind = tree.get("kind")
    return _REQUESTS[kind](tree) if isinstance(kind, str) and kind in _REQUESTS else None


def _consider(tree: dict[str, Any]) -> Consider | None:
    check_in = check_in_of(tree)
    return None if check_in is None else Consider(check_in)


def _met(tree: dict[str, Any]) -> Met | None:
    name = tree.get("name")
    return Met(name) if isinstance(name, str) and 0 < len(name) <= MOST_NAME else None


def _go_to(tree: dict[str, Any]) -> GoTo | None:
    x, y, level = _number(tree.get("x_m")), _number(tree.get("y_m")), _integer(tree.get("level", 0))
    if x is None or y is None or level is None or not 0 <= level < MOST_LEVELS:
        return None
    return GoTo(RoutePlace(x, y, level))


def _drawn(tree: dict[str, Any]) -> FrameDrawn | None:
    seq = _integer(tree.get("seq"))
    return None if seq is None else FrameDrawn(seq)


def _playing(tree: dict[str, Any]) -> SetPlaying | None:
    return SetPlaying(tree["playing"]) if isinstance(tree.get("playing"), bool) else None


def _speed(tree: dict[str, Any]) -> SetSpeed | None:
    times = _number(tree.get("times"))
    return SetSpeed(times) if times is not None and 0.0 < times <= FASTEST else None


def _seek(tree: dict[str, Any]) -> Seek | None:
    t_s = _number(tree.get("t_s"), most=1e9)
    return None if t_s is None else Seek(t_s)


def _skip(tree: dict[str, Any]) -> StepBy | None:
    by = _integer(tree.get("by"))
    return None if by is None else StepBy(by)


_REQUESTS: dict[str, Callable[[dict[str, Any]], Request | None]] = {
    "check_in": check_in_of,
    "undo": undo_of,
    "call": call_of,
    "consider": _consider,
    "met": _met,
    "go_to": _go_to,
    "go_nowhere": lambda _: EndGuidance(),
    "drawn": _drawn,
    "play": _playing,
    "speed": _speed,
    "seek": _seek,
    "skip": _skip,
}


def _number(value: Any, most: float = LIMIT_M) -> float | None:
    """The value as a float; None when it is not a number within +-`most`."""
    fits = isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= most
    return float(value) if fits else None


def _integer(value: Any) -> int | None:
    """The value when it is an integer that JavaScript represents exactly, else None."""
    return value if isinstance(value, int) and not isinstance(value, bool) and abs(value) < 1 << 53 else None
