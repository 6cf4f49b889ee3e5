# SPDX-License-Identifier: MIT
"""Derived messages of a recording, for viewers: estimates, steps, echoes, pressure, status of the board.

In: portions, and the estimates that the tracker made of them. Out: `DerivedMessage`s for the recorder. Owns a board reader, the last estimate and the
drawn track; it reads the counts and the clock of the tracker and changes nothing. A replay does not read these messages.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np

from echostep.arrays import Floats
from echostep.board.calibration import ranges
from echostep.board.frames import BoardReader, Frames
from echostep.board.messages import (
    PRESSURE_PRESSURE_INVALID,
    PRESSURE_TEMPERATURE_INVALID,
    Ping,
    Pressure,
    Ranger,
    Status,
)
from echostep.localization import Estimate
from echostep.path import MeasuredSegment, PathSegment
from echostep.ports.chunks import BOARD, Portion
from echostep.tracker import Tracker
from echostep_app.output.foxglove import (  # fmt: skip
    ELLIPSE,
    LEFT_BEAM,
    LINE_STRIP,
    NUMBER,
    RIGHT_BEAM,
    TEXT,
    TRACK,
    TRUTH,
    WHOLE,
    Place,
    Shape,
    array,
    fields,
    location,
    pose,
    scene,
    topic,
    walls,
)
from echostep_app.plan.georeference import earth_of
from echostep_app.recording.recorder import DerivedMessage, Topic

PRESSURE_PA, TEMPERATURE_C = 0.25, 0.05  # units of a count
ELLIPSE_POINTS = 17
TRACK_PIECE = 40  # points of the track in one line of the scene
BEAM_S = 1.0  # an older echo is not drawn

_SHAPES: dict[str, Shape] = {
    "float": NUMBER,
    "int": WHOLE,
    "TrackStatus": TEXT,
    "str": TEXT,
    "bool": TRUTH,
    "tuple[float, ...]": array(NUMBER),
    "tuple[LikelyPlace, ...]": array({"type": "object"}),
}
_SIDES = ("left", "right")

ESTIMATE = topic(
    "/estimate",
    fields(
        "echostep.Estimate",
        **{f.name: _SHAPES.get(str(f.type), NUMBER) for f in dataclasses.fields(Estimate)},
        heading_deg=NUMBER,
        radius95_m=NUMBER,
    ),
)
STEP = topic(
    "/step",
    fields(
        "echostep.Step", t_s=NUMBER, step=WHOLE, x_m=NUMBER, y_m=NUMBER, length_m=NUMBER, duration_s=NUMBER, speed_m_s=NUMBER, heading_deg=NUMBER,
        sd_m=NUMBER, running=TRUTH,
    ),
)  # fmt: skip
ECHO = tuple(
    topic(f"/echo/{side}", fields("echostep.Echo", ticks=WHOLE, heard=TRUTH, range_m=NUMBER, time_of_flight_us=WHOLE))
    for side in _SIDES
)
PRESSURE = topic(
    "/pressure",
    fields("echostep.Pressure", ticks=WHOLE, pressure_pa=NUMBER, temperature_c=NUMBER, speed_of_sound_m_s=NUMBER),
)
STATUS = topic(
    "/status",
    fields(
        "echostep.Status", **dict.fromkeys(Status._fields, WHOLE), frames=WHOLE, frames_rejected=WHOLE, frames_lost=WHOLE, mtx_samples=WHOLE,
        late_pings=WHOLE, bad_times=WHOLE, synchronised=TRUTH, particles=WHOLE,
    ),
)  # fmt: skip
TOPICS: tuple[Topic, ...] = (ESTIMATE, STEP, *ECHO, PRESSURE, STATUS)


class Derived:
    """Derives the messages of each portion; `take` is called after `Tracker.take` of the same portion."""

    def __init__(self, tracker: Tracker, log_offset_ns: int = 0) -> None:
        """`log_offset_ns`: times of the messages minus times of their arrival."""
        self._tracker, self._log_offset_ns = tracker, log_offset_ns
        tracker.arrival_ns(0.0)  # compiles its kernel before the run starts
        self._earth = earth_of(tracker.plan)
        # The board's bytes are decoded a second time here: `Tracker.take` cuts a portion at check-ins and beacon readings, and its front end
        # decodes the pieces one by one; the recorded messages are ordered by kind over the whole portion.
        self._board = BoardReader()
        self._walls_sent = False
        self._last: Estimate | None = None
        self._segments: dict[int, PathSegment] = {}  # of the steps since the last portion
        tracker.watchers.append(self._watch)
        self._track: list[Place] = []
        self._last_echo: dict[int, tuple[int, float]] = {}

    def _watch(self, measured: MeasuredSegment | None, estimate: Estimate) -> None:
        """Keep the first segment of each step: it is the one that moves."""
        if measured is not None:
            self._segments.setdefault(estimate.step, measured.segment)

    def take(self, portion: Portion, estimates: list[Estimate]) -> list[DerivedMessage]:
        """The messages of a portion: from its board frames by kind, then from its estimates."""
        notes: list[DerivedMessage] = []
        from_board = portion.of(BOARD)
        if from_board.received:
            frames = self._board.frames(from_board.received)
            t_ns = portion.t_arrival_ns[from_board.rows_of(frames.end)] + self._log_offset_ns
            notes += self._echoes(frames, t_ns) + self._pressures(frames, t_ns) + self._status(frames, t_ns)
        for estimate in estimates:
            notes += self._estimate(estimate)
        self._segments.clear()
        return notes

    def _echoes(self, frames: Frames, t_ns: Any) -> list[DerivedMessage]:
        frame_index, pings = frames.rows(Ping)
        notes = []
        for k, ping, range_m in zip(
            frame_index.tolist(),
            pings,
            ranges(pings, self._tracker.settings.ranger, self._tracker.front_end.air.speed_m_s).tolist(),
            strict=True,
        ):
            which, body = int(ping["ranger"]), {"ticks": int(ping["ticks"]), "heard": not math.isnan(range_m)}
            if body["heard"]:
                body |= {"range_m": range_m, "time_of_flight_us": int(ping["time_of_flight_us"])}
                self._last_echo[which] = int(t_ns[k]), range_m
            notes.append(DerivedMessage(ECHO[which], int(t_ns[k]), body))
        return notes

    def _pressures(self, frames: Frames, t_ns: Any) -> list[DerivedMessage]:
        frame_index, rows = frames.rows(Pressure)
        notes = []
        for k, row in zip(frame_index.tolist(), rows, strict=True):
            if row["pressure"] == PRESSURE_PRESSURE_INVALID:
                continue
            body: dict[str, Any] = {"ticks": int(row["ticks"]), "pressure_pa": PRESSURE_PA * int(row["pressure"])}
            body["speed_of_sound_m_s"] = round(self._tracker.front_end.air.speed_m_s, 2)
            if row["temperature"] != PRESSURE_TEMPERATURE_INVALID:
                body["temperature_c"] = round(TEMPERATURE_C * int(row["temperature"]), 3)
            notes.append(DerivedMessage(PRESSURE, int(t_ns[k]), body))
        return notes

    def _status(self, frames: Frames, t_ns: Any) -> list[DerivedMessage]:
        frame_index, rows = frames.rows(Status)
        streams = self._tracker.streams
        own = {
            "frames": streams.board.good,
            "frames_rejected": streams.board.rejected,
            "frames_lost": streams.board.lost,
            "mtx_samples": streams.mtx.good,
            "late_pings": streams.front_end.late_pings,
            "bad_times": streams.front_end.bad_times,
            "synchronised": streams.synchronised,
            "particles": self._tracker.state.particle_count,
        }
        return [
            DerivedMessage(STATUS, int(t_ns[k]), {**Status.unpack(row.tobytes())._asdict(), **own})
            for k, row in zip(frame_index.tolist(), rows, strict=True)
        ]

    def _estimate(self, e: Estimate) -> list[DerivedMessage]:
        numbers = {k: v for k, v in dataclasses.asdict(e).items() if not isinstance(v, float) or math.isfinite(v)}
        if not {"t_s", "x_m", "y_m", "heading_rad"} <= numbers.keys():
            return []
        t_ns = self._tracker.arrival_ns(e.t_s) + self._log_offset_ns
        ellipse = e.ellipse95
        body = {
            **numbers,
            "status": e.status.value,
            "heading_deg": math.degrees(e.heading_rad),
            "radius95_m": ellipse.major_m,
        }
        notes = [DerivedMessage(ESTIMATE, t_ns, body)]
        notes += pose(t_ns, (e.x_m, e.y_m, e.z_m), e.heading_rad)
        notes += self._location(e, t_ns)
        notes += self._step(e, t_ns)
        notes.append(self._scene(e, t_ns))
        self._last = e
        return notes

    def _location(self, e: Estimate, t_ns: int) -> list[DerivedMessage]:
        georeference = self._tracker.plan.georeference
        if self._earth is None or georeference is None or not e.claims_place:
            return []
        longitude, latitude = self._earth.degrees(np.array([[e.x_m, e.y_m]]))[0].tolist()
        ee, en, nn = east_north(georeference.rotation_rad, e.xx_m2, e.xy_m2, e.yy_m2)
        covariance = (ee, en, 0.0, en, nn, 0.0, 0.0, 0.0, e.z_sd_m**2)
        return [location(t_ns, longitude, latitude, e.z_m, covariance)]

    def _step(self, e: Estimate, t_ns: int) -> list[DerivedMessage]:
        """The message of a step: from the last estimate of the previous step to the first estimate with a higher step count."""
        before = self._last
        if before is None or e.step <= before.step:
            return []
        length_m, duration_s = math.hypot(e.x_m - before.x_m, e.y_m - before.y_m), e.t_s - before.t_s
        body = {
            "t_s": e.t_s, "step": e.step, "x_m": e.x_m, "y_m": e.y_m, "length_m": length_m, "duration_s": duration_s,
            "heading_deg": math.degrees(e.heading_rad),
        }  # fmt: skip
        if (segment := self._segments.get(e.step)) is not None:
            body |= {"sd_m": segment.sd_m, "running": segment.running}
        if duration_s > 0.0:
            body["speed_m_s"] = length_m / duration_s
        return [DerivedMessage(STEP, t_ns, body)]

    def _scene(self, e: Estimate, t_ns: int) -> DerivedMessage:
        """Track, ellipse and echo beams of an estimate; with the first one also the walls."""
        here = (e.x_m, e.y_m, e.z_m)
        self._track.append(here)
        piece_start = (len(self._track) - 2) // TRACK_PIECE * TRACK_PIECE if len(self._track) > 1 else 0
        drawn = {
            f"track_{piece_start}": (LINE_STRIP, TRACK, self._track[piece_start:]),
            "ellipse95": (
                LINE_STRIP,
                ELLIPSE,
                [(x, y, e.z_m) for x, y in outline95(e, ELLIPSE_POINTS).tolist() if e.is_one_place],
            ),
        }
        for which, color in ((Ranger.LEFT, LEFT_BEAM), (Ranger.RIGHT, RIGHT_BEAM)):
            echo_ns, range_m = self._last_echo.get(which, (-1 << 62, 0.0))
            axis = e.heading_rad + (0.5 if which == Ranger.LEFT else -0.5) * math.pi
            is_fresh = abs(t_ns - echo_ns) < BEAM_S * 1e9
            end = (e.x_m + range_m * math.cos(axis), e.y_m + range_m * math.sin(axis), e.z_m)
            drawn[f"echo_{_SIDES[which]}"] = (LINE_STRIP, color, [here, end] if is_fresh else [])
        if not self._walls_sent:
            self._walls_sent = True
            drawn |= {f"plan {k} {level.name}": walls(level) for k, level in enumerate(self._tracker.plan.levels)}
        return scene(t_ns, **drawn)


def east_north(rotation_rad: float, xx_m2: float, xy_m2: float, yy_m2: float) -> tuple[float, float, float]:
    """A covariance (xx, xy, yy) on the map's axes as (east, east-north, north); `rotation_rad`: from east to the map's x axis."""
    c, s = math.cos(rotation_rad), math.sin(rotation_rad)
    east = c * c * xx_m2 - 2.0 * c * s * xy_m2 + s * s * yy_m2
    north = s * s * xx_m2 + 2.0 * c * s * xy_m2 + c * c * yy_m2
    return east, c * s * (xx_m2 - yy_m2) + (c * c - s * s) * xy_m2, north


def outline95(e: Estimate, points: int) -> Floats:
    """The 95 % ellipse of an estimate as so many places (n, 2) on the map, the first one again at the end."""
    major_m, minor_m, angle_rad = e.ellipse95
    turn = np.linspace(0.0, 2.0 * math.pi, points)
    u, v = major_m * np.cos(turn), minor_m * np.sin(turn)
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    return np.column_stack((e.x_m + c * u - s * v, e.y_m + s * u + c * v))
