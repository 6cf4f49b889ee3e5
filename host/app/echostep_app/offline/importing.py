# SPDX-License-Identifier: MIT
"""A foot IMU's file, and files of other sensors, as a recording that the tracker replays.

In: `Imu`; files of rangers, a barometer, leg gyros on the same clock. Out: an MCAP recording of MTData2 messages that hold the samples as 32-bit
floats, and of a board's messages. Owns nothing.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

import numpy as np

from echostep.arrays import Floats
from echostep.board.calibration import ADIS16100_RAD_S, MOST_AHEAD_DEG, SPEED_OF_SOUND_M_S
from echostep.board.frames import encode
from echostep.board.messages import GYROS_INVALID, PRESSURE_TEMPERATURE_INVALID, Gyros, Outcome, Ping, Pressure, Ranger
from echostep.errors import EchostepError
from echostep.offline.csv_table import lines_of, open_samples
from echostep.offline.imu_csv import LIMITS, Imu
from echostep.ports.chunks import BOARD, Chunk
from echostep.settings import imu_settings, parse_settings, read_settings
from echostep.timing.timeline import TICKS_PER_S
from echostep_app.offline.floors.pressure_csv import load_pressures
from echostep_app.offline.foreign_columns import OWN, Naming, read_header
from echostep_app.offline.imu_chunks import ImuChunks
from echostep_app.offline.leg_csv import load_pair
from echostep_app.offline.ros_bag import RANGE, is_bag, read_bag
from echostep_app.recording.recorder import Recorder

Message = Ping | Pressure | Gyros
GAP = 1.5  # periods: a longer step is a gap
AT_ONCE = 10_000  # samples, which bound the memory
FARTHEST_M = 0.5 * 65_535e-6 * SPEED_OF_SOUND_M_S  # that a ping can state
RANGES = ("t_s", "direction_deg", "range_m")


@dataclass(frozen=True, slots=True)
class Beside:
    """Files of other sensors, None without: `ranges` t_s, direction_deg (left positive), range_m; `pressure` t_s, pressure_pa; `legs` as of the
    command; `settings` (TOML) of the rangers, for instance; `topics` of bags.
    """

    pressure: Path | None = None
    ranges: Path | None = None
    legs: Path | None = None
    settings: Path | None = None
    topics: Naming = OWN


def import_imu(imu: Imu, name: str, out: Path, about: Mapping[str, str], beside: Beside = Beside()) -> str:
    """Record the samples of the file `name` in the new file `out`, with the metadata `about`; returns the counts in words. Raises EchostepError."""
    rate_hz, begin_s = rate_of(imu.t_s), float(imu.t_s[0])
    messages, settings = _messages(beside)
    within = [each for each in messages if begin_s <= each[0] <= imu.t_s[-1]]
    for kind, path in ((Ping, beside.ranges), (Pressure, beside.pressure), (Gyros, beside.legs)):
        if path and not any(isinstance(message, kind) for _, message in within):
            span = f"{begin_s:.3f} to {imu.t_s[-1]:.3f} s"
            raise EchostepError(f"{path}: nothing in it from {span}, as {name}: t_s in seconds, of one clock?")
    text = imu_settings(rate_hz) + settings
    parse_settings(text, str(beside.settings or name))
    chunks = ImuChunks(rate_hz)
    sensors = ", ".join(each for each in ("ranges", "pressure", "legs") if getattr(beside, each)) or "no other sensor"
    with Recorder(
        out, {**about, "note": f"imported from {name}: a foot IMU, {sensors}", "settings_toml": text}
    ) as recorder:
        for chunk in heapq.merge(_samples(imu, chunks), _frames(within, begin_s), key=lambda chunk: chunk.t_arrival_ns):
            recorder.wait_for_disk(chunk)
            recorder.write(chunk)
    recorder.check_whole()
    kept = len(imu.t_s) - chunks.left_out
    outside = len(messages) - len(within)
    more = f"{len(within)} messages of {sensors}, {outside} left out as before or after the foot's; " * bool(messages)
    told = f"{kept} samples at {rate_hz:.4g} Hz, {chunks.left_out} left out as within the same period; {more}"
    return f"{told}t_s of its track counts from {begin_s:.3f} s in the file"


def rate_of(t_s: Floats) -> float:
    """Samples a second, from the times (n,), without the gaps; times in whole milliseconds give it, too."""
    steps = np.diff(t_s)
    steps = steps[steps > 0.0]
    return round(1.0 / float(steps[steps < GAP * np.median(steps)].mean()), 3)


def _samples(imu: Imu, chunks: ImuChunks) -> Iterator[Chunk]:
    """The samples' chunks, some at a time."""
    for k in range(0, len(imu.t_s), AT_ONCE):
        part = slice(k, k + AT_ONCE)
        yield from chunks.of(imu.t_s[part], imu.accel[part], imu.gyro[part])


def _frames(messages: list[tuple[float, Message]], begin_s: float) -> Iterator[Chunk]:
    """A board's messages, each arriving at its time."""
    for k, (t_s, message) in enumerate(messages):
        ticks = round(TICKS_PER_S * (t_s - begin_s)) & 0xFFFF_FFFF
        yield Chunk(BOARD, round(1e9 * (t_s - begin_s)), encode(message._replace(ticks=ticks), k))


def _messages(beside: Beside) -> tuple[list[tuple[float, Message]], str]:
    """Times and messages of the other sensors in order of time, and the settings that they need."""
    found: list[tuple[float, Message]] = []
    settings = read_settings(beside.settings) if beside.settings else ""
    if beside.pressure:
        air = load_pressures(beside.pressure, beside.topics if is_bag(beside.pressure) else OWN).samples
        quarters = zip(air.t_s.tolist(), np.rint(4.0 * air.pressure_pa).astype(int).tolist(), strict=True)
        found += [(t, Pressure(0, count, PRESSURE_TEMPERATURE_INVALID)) for t, count in quarters]
    if beside.ranges:
        pings, ahead_deg = _pings(beside.ranges, beside.topics)
        found += pings
        settings = f"\n[ranger]\nspeed_of_sound_m_s = {SPEED_OF_SOUND_M_S}\nahead_deg = {ahead_deg!r}\n\n{settings}"
    if beside.legs:
        leg = load_pair([beside.legs])[0]
        counts = np.column_stack([leg.thigh, leg.shank, leg.belt]) / ADIS16100_RAD_S
        counts = np.where(np.abs(counts) < -GYROS_INVALID, np.round(counts), GYROS_INVALID).astype(int)
        found += [(t, Gyros(0, *row)) for t, row in zip(leg.t_s.tolist(), counts.tolist(), strict=True)]
    return sorted(found, key=lambda each: each[0]), settings


def _pings(path: Path, topics: Naming) -> tuple[list[tuple[float, Message]], float]:
    """Times and pings of a file of ranges, an empty range being no echo; how far ahead of abeam (deg) its rangers look."""
    rows = _bag_ranges(path, topics) if is_bag(path) else open_samples(path, _ranges)
    ahead = np.unique(90.0 - np.abs(rows[:, 1]))
    if len(ahead) != 1 or abs(ahead[0]) > MOST_AHEAD_DEG:
        raise EchostepError(
            f"{path}: direction_deg {', '.join(f'{each:g}' for each in np.unique(rows[:, 1])[:4])}: expected one ranger to the left (90) and one to "
            f"the right (-90), both as far ahead, at most {MOST_AHEAD_DEG:g} degrees"
        )
    values = np.unique(rows[rows[:, 2] > 0.0, 2])
    if (beyond := int((values > FARTHEST_M).sum())) > 1 and 2 * beyond > len(values):
        raise EchostepError(f"{path}: range_m is {np.median(values):g}: metres up to {FARTHEST_M:.0f} are expected")
    pings: list[tuple[float, Message]] = []
    for t_s, direction, range_m in rows.tolist():
        heard = 0.0 < range_m < FARTHEST_M
        flight_us = round(2e6 * range_m / SPEED_OF_SOUND_M_S) if heard else 0
        side = Ranger.LEFT if direction > 0.0 else Ranger.RIGHT
        pings.append((t_s, Ping(0, side, Outcome.ECHO if heard else Outcome.NO_ECHO, flight_us)))
    return pings, float(ahead[0])


def _bag_ranges(path: Path, topics: Naming) -> Floats:
    """RANGES (n, 3) of a bag's rangers, which look to the left and to the right."""
    both = [(90.0, read_bag(path, RANGE, "left", topics)[0]), (-90.0, read_bag(path, RANGE, "right", topics)[0])]
    return np.vstack([np.insert(rows, 1, direction_deg, axis=1) for direction_deg, rows in both])


def _ranges(file: TextIO) -> Floats:
    """RANGES (n, 3), NaN for an empty range; rows without a time or direction left out; raises ValueError."""
    lines = lines_of(file, LIMITS)
    head = read_header(lines, OWN)
    if not set(RANGES) <= set(head.names):
        raise ValueError(f"expected the columns {','.join(RANGES)}; there are {', '.join(head.names)[:300]}")
    rows = head.table(lines, RANGES, 2, LIMITS).values
    return rows[np.isfinite(rows[:, :2]).all(axis=1)]
