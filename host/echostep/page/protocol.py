"""The protocol between server and page: frames as bytes, the plan as JSON, requests as checked objects.

In: scenes and plans; texts from WebSockets. Out: bytes for WebSockets; requests. Owns nothing. A frame, little-endian:

    u32         length of the JSON header, padded with spaces to a multiple of four
    bytes       the header; its keys "trail" and "cloud" say how many rows follow
    float32[3]  x, y, level of each new point of the trail
    u16[], u16[], u8[], u8[]   x, y, weight, level of all particles, column by column; x and y on the grid of the header's "cloud"
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from echostep.page.elements.guidance import ShownGuidance
from echostep.page.elements.scene import KNOWN_HEADING_RAD, PageScene, ParticleSample
from echostep.plan.json_fields import LIMIT_M
from echostep.plan.model import Plan
from echostep.plan.routing import RoutePlace
from echostep.ports.check_in import MOST_LEVELS, CheckIn, check_in_of

MOST_REQUEST = 2048  # bytes
GRID = 65535.0  # cells across the cloud: the greatest u16
FASTEST = 32.0  # times as fast as it was recorded
TRAIL_ROW_BYTES = 12  # float32 x, y, level


@dataclass(frozen=True, slots=True)
class GoTo:
    """Guide the wearer to a place."""

    goal: RoutePlace


@dataclass(frozen=True, slots=True)
class EndGuidance:
    """End the guidance to the page's own destination."""


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


Request = CheckIn | GoTo | EndGuidance | FrameDrawn | SetPlaying | SetSpeed | Seek | StepBy


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


def hello(plan: Plan, title: str, *, replay: bool) -> str:
    """The first message to a page, as JSON: the plan without its walls, the title, and whether the run is a replay."""
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
    """The walls of a level (an index into the plan's levels) as rows of float32 x0, y0, x1, y1 in metres."""
    return plan.levels[level].solid.astype("<f4").tobytes()


def frame(
    scene: PageScene,
    seq: int,
    trail: bytes,
    trail_from: int,
    particles: ParticleSample | None,
    guidance: ShownGuidance | None,
    play: dict[str, Any] | None,
) -> bytes:
    """A frame as bytes, in the layout of this module's docstring.

    `seq`: the page returns it when the frame is drawn. `trail`: float32 rows x, y, level, the first of which has the number `trail_from`.
    `particles`: None when the page has them already. `play`: state of a replay.
    """
    grid, cloud = (None, b"") if particles is None else _cloud(particles)
    header = {
        "kind": "frame",
        "seq": seq,
        "t_s": scene.t_s,
        "words": scene.status_text,
        "told": _estimate(scene),
        "beams": [asdict(beam) for beam in scene.echo_lines],
        "streams": asdict(scene.streams) if scene.streams else None,
        "trail": {"from": trail_from, "count": len(trail) // TRAIL_ROW_BYTES},
        "cloud": grid,
        "beacons": [asdict(mark) for mark in scene.beacons],
        "guidance": asdict(guidance) if guidance else None,
        "play": play,
    }
    text = json.dumps(header, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    return len(text).to_bytes(4, "little") + text + trail + cloud


def _estimate(scene: PageScene) -> dict[str, Any] | None:
    """The estimate as the page reads it: position, ellipse, heading, status, share of the particles on each level."""
    e = scene.estimate
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


def _cloud(particles: ParticleSample) -> tuple[dict[str, float], bytes]:
    """Header and columns of the particles. Positions are rounded to a square grid of 65535 cells over all of them."""
    x, y = np.nan_to_num(particles.x_m), np.nan_to_num(particles.y_m)
    x0, y0 = float(x.min()), float(y.min())
    step = max(float(x.max()) - x0, float(y.max()) - y0, 1e-3) / GRID
    columns = [((v - v0) / step).round().clip(0.0, GRID).astype("<u2").tobytes() for v, v0 in ((x, x0), (y, y0))]
    grid = {"count": len(x), "x0_m": x0, "y0_m": y0, "step_m": step}
    return grid, b"".join(columns) + particles.weight.tobytes() + particles.level.tobytes()
