"""The wire between server and page: frames as bytes, the plan as JSON, requests as checked objects.

In: scenes and plans; texts from sockets. Out: bytes for sockets; requests. Owns nothing. A frame is a u32 (little-endian) length, a JSON header
padded to four bytes, the trail's new points as float32 rows x, y, level, and the cloud as columns of u16 x, u16 y (a grid that the
header gives), u8 weight, u8 level.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from echostep.page.elements.guidance import Guidance
from echostep.page.elements.scene import KNOWN_HEADING_RAD, PageScene, Specks
from echostep.plan.json_fields import LIMIT_M
from echostep.plan.model import Plan
from echostep.plan.routing import RoutePlace
from echostep.ports.check_in import MOST_LEVELS, CheckIn, check_in_of

MOST_REQUEST = 2048  # bytes
GRID = 65535.0
FASTEST = 32.0


@dataclass(frozen=True, slots=True)
class GoTo:
    """Guide me to a place."""

    goal: RoutePlace


@dataclass(frozen=True, slots=True)
class GoNowhere:
    """No guidance any more."""


@dataclass(frozen=True, slots=True)
class Drawn:
    """The page has drawn a frame."""

    seq: int


@dataclass(frozen=True, slots=True)
class Playing:
    """Let the replay run, or stop it."""

    playing: bool


@dataclass(frozen=True, slots=True)
class Speed:
    """So many times as fast as it was."""

    times: float


@dataclass(frozen=True, slots=True)
class Seek:
    """Show the moment `t_s`."""

    t_s: float


@dataclass(frozen=True, slots=True)
class Skip:
    """Show so many estimates on, or back."""

    by: int


Request = CheckIn | GoTo | GoNowhere | Drawn | Playing | Speed | Seek | Skip


def parse_request(text: str) -> Request | None:
    """A page's request; None for anything that is none."""
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


def _go_to(tree: dict[str, Any]) -> GoTo | None:
    x, y, level = _number(tree.get("x_m")), _number(tree.get("y_m")), _whole(tree.get("level", 0))
    return (
        None
        if x is None or y is None or level is None or not 0 <= level < MOST_LEVELS
        else GoTo(RoutePlace(x, y, level))
    )


def _drawn(tree: dict[str, Any]) -> Drawn | None:
    seq = _whole(tree.get("seq"))
    return None if seq is None else Drawn(seq)


def _playing(tree: dict[str, Any]) -> Playing | None:
    return Playing(tree["playing"]) if isinstance(tree.get("playing"), bool) else None


def _speed(tree: dict[str, Any]) -> Speed | None:
    times = _number(tree.get("times"))
    return Speed(times) if times is not None and 0.0 < times <= FASTEST else None


def _seek(tree: dict[str, Any]) -> Seek | None:
    t_s = _number(tree.get("t_s"), most=1e9)
    return None if t_s is None else Seek(t_s)


def _skip(tree: dict[str, Any]) -> Skip | None:
    by = _whole(tree.get("by"))
    return None if by is None else Skip(by)


_REQUESTS: dict[str, Callable[[dict[str, Any]], Request | None]] = {
    "check_in": check_in_of,
    "go_to": _go_to,
    "go_nowhere": lambda _: GoNowhere(),
    "drawn": _drawn,
    "play": _playing,
    "speed": _speed,
    "seek": _seek,
    "skip": _skip,
}


def _number(value: Any, most: float = LIMIT_M) -> float | None:
    fits = isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= most
    return float(value) if fits else None


def _whole(value: Any) -> int | None:
    return value if isinstance(value, int) and not isinstance(value, bool) and abs(value) < 1 << 53 else None


def hello(plan: Plan, title: str, *, replay: bool) -> str:
    """What a page must know first: the plan without its walls, and what kind of run this is."""
    levels = [
        {
            "name": level.name,
            "height_m": level.height_m,
            "walls": len(level.solid),
            "rooms": [asdict(r) for r in level.rooms],
        }
        for level in plan.levels
    ]
    run = {
        "kind": "hello",
        "title": title,
        "replay": replay,
        "plan": {"name": plan.name, "digest": plan.digest, "levels": levels},
    }
    return json.dumps(run)


def walls(plan: Plan, level: int) -> bytes:
    """The walls of a level as float32 x0 y0 x1 y1."""
    return plan.levels[level].solid.astype("<f4").tobytes()


def frame(
    scene: PageScene,
    serial: int,
    trail: bytes,
    trail_from: int,
    specks: Specks | None,
    guidance: Guidance | None,
    play: dict[str, Any] | None,
) -> bytes:
    """One frame; `serial` comes back when it is drawn; `trail`: float32 rows x, y, level from `trail_from` on.

    `specks`: None when the page has them already.
    """
    grid, cloud = (None, b"") if specks is None else _cloud(specks)
    header = {
        "kind": "frame",
        "seq": serial,
        "t_s": scene.t_s,
        "words": scene.words,
        "told": _told(scene),
        "beams": [asdict(beam) for beam in scene.beams],
        "streams": asdict(scene.streams) if scene.streams else None,
        "trail": {"from": trail_from, "count": len(trail) // 12},
        "cloud": grid,
        "beacons": [asdict(mark) for mark in scene.marks],
        "guidance": asdict(guidance) if guidance else None,
        "play": play,
    }
    text = json.dumps(header, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    return len(text).to_bytes(4, "little") + text + trail + cloud


def _told(scene: PageScene) -> dict[str, Any] | None:
    e = scene.told
    if e is None:
        return None
    ellipse = e.ellipse95
    return {
        "x_m": e.x_m,
        "y_m": e.y_m,
        "level": e.level,
        "major_m": ellipse.major_m,
        "minor_m": ellipse.minor_m,
        "angle_rad": ellipse.angle_rad,
        "heading_rad": e.heading_rad,
        "heading_sd_rad": e.heading_sd_rad if math.isfinite(e.heading_sd_rad) else math.pi,
        "heading_known": e.heading_sd_rad <= KNOWN_HEADING_RAD,
        "step": e.step,
        "status": e.status.value,
        "levels": e.levels,
        "z_m": e.z_m,
        "z_sd_m": e.z_sd_m,
    }


def _cloud(specks: Specks) -> tuple[dict[str, float], bytes]:
    """Header and columns of a cloud, on a grid of 65535 by 65535 over it."""
    x, y = np.nan_to_num(specks.x_m), np.nan_to_num(specks.y_m)
    x0, y0 = float(x.min()), float(y.min())
    step = max(float(x.max()) - x0, float(y.max()) - y0, 1e-3) / GRID
    columns = [((v - v0) / step).round().clip(0.0, GRID).astype("<u2").tobytes() for v, v0 in ((x, x0), (y, y0))]
    grid = {"count": len(x), "x0_m": x0, "y0_m": y0, "step_m": step}
    return grid, b"".join(columns) + specks.weight.tobytes() + specks.level.tobytes()
