# SPDX-License-Identifier: MIT
"""Everything that goes to a page: typed messages and their bytes. No other module encodes anything for a page.

In: plans, scenes, answers. Out: JSON for texts, bytes for frames and lines of plans. Owns nothing. Numbers of numpy are written as numbers, NaN and
infinity as null; a field that cannot be encoded is a TypeError here. A frame, little-endian:

    u32         length of the JSON header, padded with spaces to a multiple of four
    bytes       the header (`FrameHeader`); its keys "trail", "drawing" and "cloud" say how many rows follow
    float32[3]  x, y, level of each new point of the trail
    float32[5]  x0, y0, x1, y1, standard deviation of each wall of a new drawing
    float32[2]  x, y of each point of the path that it corrects
    u16[], u16[], u8[], u8[]   x, y, weight, level of all particles, column by column; x and y on the grid of the header's "cloud"
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import msgspec
import numpy as np

from echostep.particles.ellipse import Ellipse
from echostep.plan import Plan
from echostep_app.page.elements.alarm import ShownAlarm
from echostep_app.page.elements.drawn_walls import ShownDrawing
from echostep_app.page.elements.echo_lines import EchoLine
from echostep_app.page.elements.guidance import ShownGuidance
from echostep_app.page.elements.likely_places import numbered
from echostep_app.page.elements.marks import BeaconMark, ShownMark, ShownMeeting, ShownOrder
from echostep_app.page.elements.scene import PageScene, ParticleSample, TruePosition
from echostep_app.page.elements.stream_rates import StreamRates
from echostep_app.page.elements.taps import Considered
from echostep_app.page.elements.undo_offer import UndoOffer
from echostep_app.page.over_time import COLUMNS, Event, OverTime
from echostep_app.page.player import PlayState
from echostep_app.plan.pictures.symbols import level_lines, way_names
from echostep_app.plan.places.bearing import KNOWN_HEADING_RAD, north_rad
from echostep_app.plan.places.globe import Globe, globe_of
from echostep_app.plan.routing import Goal

FRAME_S = 1.0 / 30.0  # shortest time between two frames
GRID = 65535.0  # cells across the cloud: the greatest u16
TRAIL_ROW_BYTES = 12  # float32 x, y, level

# The field names of all classes here are keys of the JSON.


@dataclass(frozen=True, slots=True)
class RoomLabel:
    """A room's name and where it is written."""

    name: str
    at_m: tuple[float, float]


@dataclass(frozen=True, slots=True)
class LevelLabels:
    """A level without its lines. `ways`: names of stairs, lifts and ramps."""

    name: str
    height_m: float
    rooms: tuple[RoomLabel, ...]
    ways: tuple[RoomLabel, ...]


@dataclass(frozen=True, slots=True)
class PlanLabels:
    """A plan without its lines. `north_rad`: direction of north on it, counter-clockwise from the map's x axis. `globe`: where it is on the Earth."""

    name: str
    digest: str
    north_rad: float
    levels: tuple[LevelLabels, ...]
    globe: Globe | None


@dataclass(frozen=True, slots=True)
class Hello:
    """The first message to a page. `replay`: the run is a replay. `takes_files`: the page plays recordings that are dropped onto it.

    `run`: a name of this run, which another one on the same address does not have.
    """

    title: str
    replay: bool
    plan: PlanLabels
    takes_files: bool = False
    run: str = ""
    kind: Literal["hello"] = "hello"


@dataclass(frozen=True, slots=True)
class Beat:
    """The server is there, at `now_s` of its monotonic clock; the run behind it was so `age_s` seconds ago."""

    age_s: float
    now_s: float
    kind: Literal["beat"] = "beat"


@dataclass(frozen=True, slots=True)
class Answered:
    """The request of this identity has been taken; or it was refused, and why."""

    request: str
    reason: str
    kind: Literal["answered"] = "answered"


@dataclass(frozen=True, slots=True)
class Refused:
    """The answer to a request that was not carried out, and the reason in words."""

    reason: str
    kind: Literal["refused"] = "refused"


@dataclass(frozen=True, slots=True)
class Failed:
    """The server has a fault, or the run was ended by an error, in words; the socket is closed after this message."""

    reason: str
    ended: bool = False
    kind: Literal["failed"] = "failed"


@dataclass(frozen=True, slots=True)
class ShownHypothesis:
    """A place that fits, its number in the sentence that names it, and its probability."""

    number: int
    probability: float
    x_m: float
    y_m: float
    level: int


@dataclass(frozen=True, slots=True)
class ShownEstimate:
    """The estimate as the page reads it: position, `where` in words, 95 % ellipse (0: none), heading, status, share of the particles on each level.

    `heading`: in words. `protection_m`: the error is beyond it at a risk of 1 in 1,000; None where no radius is that safe. `hypotheses`: while
    several places fit; `places` names them in a sentence.
    `placed`: it claims a place; otherwise no position is written or drawn.
    """

    x_m: float
    y_m: float
    level: int
    where: str
    placed: bool
    major_m: float
    minor_m: float
    angle_rad: float
    heading: str
    heading_rad: float
    heading_known: bool
    step: int
    status: str
    levels: tuple[float, ...]
    z_m: float
    z_sd_m: float
    protection_m: float | None
    hypotheses: tuple[ShownHypothesis, ...]
    places: str


@dataclass(frozen=True, slots=True)
class TrailPart:
    """Points of the trail in this frame: `count` of them, the first with the number `first`."""

    first: int
    count: int


@dataclass(frozen=True, slots=True)
class DrawingPart:
    """A new drawing in this frame: numbers of walls and points; 0 without a drawing. It ends where the trail has `trail_count` points."""

    walls: int
    points: int
    trail_count: int


@dataclass(frozen=True, slots=True)
class CloudGrid:
    """Number of particles, and the grid of their positions."""

    count: int
    x0_m: float
    y0_m: float
    step_m: float


@dataclass(frozen=True, slots=True)
class FrameHeader:
    """One moment. `seq`: the page returns it when the frame is drawn. `goal`: the destination that was chosen on a page of this run.

    `errand`: who sent the wearer there, in words; empty when the wearer chose it. `orders`: those that are not understood yet. `team`: names of the
    teammates for meetings, when they have changed; `met`: result of the newest meeting. `gait`: that the wearer runs.
    """

    seq: int
    t_s: float
    words: str
    gait: str
    told: ShownEstimate | None
    beams: tuple[EchoLine, ...]
    streams: StreamRates | None
    trail: TrailPart
    drawing: DrawingPart | None
    cloud: CloudGrid | None
    beacons: tuple[BeaconMark, ...]
    guidance: ShownGuidance | None
    goal: Goal | None
    errand: str
    orders: tuple[ShownOrder, ...]
    undo: UndoOffer | None
    play: PlayState | None
    truth: TruePosition | None
    alarm: ShownAlarm | None
    marks: tuple[ShownMark, ...] | None
    team: tuple[str, ...] | None
    met: ShownMeeting | None
    ended: str | None
    kind: Literal["frame"] = "frame"


Message = Hello | Beat | Answered | Refused | Failed | Considered


def _plain(value: Any) -> Any:
    """A number of numpy as a Python number."""
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"{type(value).__name__} in a message to the page")


_ENCODER = msgspec.json.Encoder(enc_hook=_plain)


def encode(message: Message) -> str:
    """A message as JSON."""
    return _ENCODER.encode(message).decode()


def hello(plan: Plan, title: str, run: str, *, replay: bool, takes_files: bool = False) -> Hello:
    """The first message of a run on this plan."""
    levels = tuple(_labels(plan, k) for k in range(len(plan.levels)))
    shown = PlanLabels(plan.name, plan.digest, north_rad(plan), levels, globe_of(plan))
    return Hello(title, replay, shown, takes_files, run)


def _labels(plan: Plan, k: int) -> LevelLabels:
    level = plan.levels[k]
    rooms = tuple(RoomLabel(room.name, room.at_m) for room in level.rooms)
    ways = tuple(RoomLabel(name, at_m) for name, at_m in way_names(plan, k))
    return LevelLabels(level.name, level.height_m, rooms, ways)


def lines(plan: Plan, level: int) -> bytes:
    """The lines of a level (an index into the plan's levels): a header with their numbers by kind, and rows of float32 x0, y0, x1, y1 in metres."""
    by_kind = level_lines(plan, level)
    rows = np.concatenate(list(by_kind.values())).astype("<f4").tobytes()
    return packed({kind: len(lines) for kind, lines in by_kind.items()}, rows)


@dataclass(frozen=True, slots=True)
class OverTimePart:
    """The header of an answer about a run over time: `rows` of float32 from row `begin` on (`page/over_time.py`), and all events."""

    begin: int
    rows: int
    columns: int
    events: tuple[Event, ...]


def over_time(run: OverTime, begin: int) -> bytes:
    """A run over time from row number `begin` on: a header and rows of float32."""
    end = len(run)
    begin = min(begin, end)
    return packed(OverTimePart(begin, end - begin, COLUMNS, run.events), run.part(begin, end))


@dataclass(frozen=True, slots=True)
class FrameParts:
    """The parts of a frame without its scene, for one page.

    `where`, `heading`: of the estimate in words; it claims a place if `placed`. `places`: its hypotheses in a sentence. `trail`: float32 rows x,
    y, level, the first numbered `trail_from`.
    `particles`, `drawing`: None when the page has them already. `play`: state of a replay. `ended`: how well the run went, when this is its end.
    """

    seq: int
    where: str = ""
    heading: str = ""
    placed: bool = True
    places: str = ""
    trail: bytes = b""
    trail_from: int = 0
    particles: ParticleSample | None = None
    guidance: ShownGuidance | None = None
    goal: Goal | None = None
    errand: str = ""
    orders: tuple[ShownOrder, ...] = ()
    play: PlayState | None = None
    marks: tuple[ShownMark, ...] | None = None
    drawing: ShownDrawing | None = None
    team: tuple[str, ...] | None = None
    ended: str | None = None


def frame(scene: PageScene, parts: FrameParts) -> bytes:
    """A frame as bytes, in the layout of this module's docstring."""
    grid, cloud = (None, b"") if parts.particles is None else _cloud(parts.particles)
    part, drawing = (None, b"") if parts.drawing is None else _drawing(parts.drawing)
    header = FrameHeader(
        seq=parts.seq,
        t_s=scene.t_s,
        words=scene.status_text,
        gait=scene.gait,
        told=_estimate(scene, parts),
        beams=scene.echo_lines,
        streams=scene.streams,
        trail=TrailPart(parts.trail_from, len(parts.trail) // TRAIL_ROW_BYTES),
        drawing=part,
        cloud=grid,
        beacons=scene.beacons,
        guidance=parts.guidance,
        goal=parts.goal,
        errand=parts.errand,
        orders=parts.orders,
        undo=scene.undo,
        play=parts.play,
        truth=scene.truth,
        alarm=scene.alarm,
        marks=parts.marks,
        team=parts.team,
        met=scene.met,
        ended=parts.ended,
    )
    return packed(header, parts.trail + drawing + cloud)


def packed(header: object, rows: bytes) -> bytes:
    """The length of a header (u32, little-endian), the header as JSON, padded with spaces to a multiple of four, and rows of numbers."""
    text = _ENCODER.encode(header)
    text += b" " * (-len(text) % 4)
    return len(text).to_bytes(4, "little") + text + rows


def _estimate(scene: PageScene, parts: FrameParts) -> ShownEstimate | None:
    e = scene.estimate
    if e is None:
        return None
    return ShownEstimate(
        x_m=e.x_m,
        y_m=e.y_m,
        level=e.level,
        where=parts.where,
        placed=parts.placed,
        **(e.ellipse95 if e.is_one_place else Ellipse(0.0, 0.0, 0.0))._asdict(),
        heading=parts.heading,
        heading_rad=e.heading_rad,
        heading_known=e.heading_sd_rad <= KNOWN_HEADING_RAD,
        step=e.step,
        status=e.status.value,
        levels=e.levels,
        z_m=e.z_m,
        z_sd_m=e.z_sd_m,
        protection_m=e.protection_m if np.isfinite(e.protection_m) else None,
        hypotheses=tuple(
            ShownHypothesis(n, h.probability, h.x_m, h.y_m, h.level) for n, h in numbered(e, scene.numbers)
        ),
        places=parts.places,
    )


def _drawing(drawing: ShownDrawing) -> tuple[DrawingPart, bytes]:
    """Header and rows of a drawing."""
    part = DrawingPart(len(drawing.walls), len(drawing.path), drawing.trail_count)
    return part, drawing.walls.astype("<f4").tobytes() + drawing.path.astype("<f4").tobytes()


def _cloud(particles: ParticleSample) -> tuple[CloudGrid, bytes]:
    """Header and columns of the particles. Positions are rounded to a square grid of 65535 cells over all of them."""
    x, y = np.nan_to_num(particles.x_m), np.nan_to_num(particles.y_m)
    x0, y0 = float(x.min()), float(y.min())
    step = max(float(x.max()) - x0, float(y.max()) - y0, 1e-3) / GRID
    columns = [((v - v0) / step).round().clip(0.0, GRID).astype("<u2").tobytes() for v, v0 in ((x, x0), (y, y0))]
    return CloudGrid(len(x), x0, y0, step), b"".join(columns) + particles.weight.tobytes() + particles.level.tobytes()
