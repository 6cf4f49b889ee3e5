"""`echostep calibrate`: the wearer's gyros, compass and mounting, measured in a minute and written as settings.

In: the board's port, and a wearer who stands still and turns when asked. Out: a settings file (TOML) for `--settings`, whose other sections are
kept. Owns the questions; the port is listened to by `listening`.
"""

from __future__ import annotations

import math
import sys
import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.console import Console

from echostep.calibration import ADIS16100_RAD_S, GYROS, NO_RATE
from echostep.errors import EchostepError
from echostep.health import Severity, board_findings
from echostep.listening import TICKS_PER_S, Heard, listen
from echostep.ports import BOARD_NAME, Role, access_findings, find, list_seen
from echostep.settings import parse_settings, read_settings
from echostep.sources import BOARD

Floats = NDArray[np.float64]
Values = dict[str, float | bool]

STILL_S, TURN_S = 10.0, 20.0
PIECE_S = 1.0
STILL_SD_RAD_S = math.radians(2.0)  # noise of an ADIS16100 is 0.6 degrees/s in 40 Hz; who sways does more
STILL_SPREAD_RAD_S = math.radians(1.0)  # between the means of still pieces
BIAS_MAX_RAD_S = math.radians(30.0)
LEAST_STILL = 0.6  # share of the pieces
FULL_TURN_RAD = math.radians(300.0)


@dataclass(frozen=True, slots=True)
class Part:
    """One thing to calibrate: what the wearer does, for how long, and what is found: section -> values, and a line for him."""

    name: str
    request: str
    seconds: float
    find: Callable[[Heard], tuple[dict[str, Values], str]]


def calibrate(port: str | None, names: list[str], out: Path, console: Console) -> None:
    """Ask, listen, find and write; raises EchostepError with what was wrong and what to do again."""
    parts = [PARTS[name] for name in (names or PARTS) if _known(name)]
    wanted = port or find(list_seen(), Role.BOARD, BOARD_NAME)
    if wanted is None:
        raise EchostepError("no board is plugged in: plug it in, or name its port with --board; see echostep doctor")
    for finding in access_findings("board", wanted):
        raise EchostepError(str(finding))
    sections = _sections(out)
    for part in parts:
        console.print(part.request)
        if sys.stdin.isatty():
            console.input("Press Enter to begin. ")
        console.print(f"Listening for {part.seconds:g} s.")
        heard = listen({BOARD: wanted}, part.seconds)
        _check(heard, wanted)
        found, line = part.find(heard)
        console.print(line)
        for section, values in found.items():
            sections.setdefault(section, {}).update(values)
        _write(out, sections)
    console.print(f"{out}: use it with --settings {out}")


def _known(name: str) -> bool:
    if name not in PARTS:
        raise EchostepError(f"{name}: there is nothing of that name to calibrate; there are {', '.join(PARTS)}")
    return True


def _check(heard: Heard, port: str) -> None:
    if heard.stale:
        raise EchostepError(heard.stale)
    if heard.words.identity is None:
        raise EchostepError(f"{port}: no word of the board: run echostep doctor")
    faults = [f for f in board_findings(heard.words) if f.severity is Severity.FAULT and "gyro" in f.subject]
    if len(faults) == len(GYROS):
        raise EchostepError(str(faults[0]))


def gyro_rates(heard: Heard) -> tuple[Floats, Floats]:
    """Times (n,) s and rates (n, 3) rad/s of thigh, calf and belt; NaN where a gyro gave none."""
    t_s = np.array(heard.ticks.get("Gyros", []), float) / TICKS_PER_S
    counts = np.array([g[1:] for g in heard.gyros], float).reshape(-1, len(GYROS))
    counts[counts == NO_RATE] = np.nan
    return t_s, ADIS16100_RAD_S * counts


def still_bias(t_s: Floats, rate: Floats) -> tuple[float, float]:
    """Bias and noise (rad/s) of a gyro that stood still for most of the time; raises ValueError that says what was wrong."""
    there = np.isfinite(rate)
    if there.sum() < 100:
        raise ValueError("it gave no values: run echostep doctor")
    piece = ((t_s[there] - t_s[there][0]) / PIECE_S).astype(int)
    pieces = [rate[there][piece == k] for k in range(piece[-1] + 1) if (piece == k).sum() >= 20]
    quiet = [values for values in pieces if values.std() <= STILL_SD_RAD_S]
    means = np.array([values.mean() for values in quiet])
    kept = [v for v, mean in zip(quiet, means, strict=True) if abs(mean - np.median(means)) <= STILL_SPREAD_RAD_S]
    if len(kept) < LEAST_STILL * len(pieces):
        raise ValueError("it moved: stand still, or lay the board down, and do it again")
    still = np.concatenate(kept)
    if abs(still.mean()) > BIAS_MAX_RAD_S:
        raise ValueError(
            f"{math.degrees(still.mean()):.0f} degrees/s at rest: it turned evenly, or the gyro is damaged"
        )
    return float(still.mean()), float(still.std())


def find_gyros(heard: Heard) -> tuple[dict[str, Values], str]:
    """Biases of the gyros that answer."""
    t_s, rate = gyro_rates(heard)
    values: Values = {}
    said = []
    for k, name in enumerate(GYROS):
        if not np.isfinite(rate[:, k]).any():
            said.append(f"{name} none (it does not answer)")
            continue
        try:
            bias, noise = still_bias(t_s, rate[:, k])
        except ValueError as error:
            raise EchostepError(f"{name} gyro: {error}") from error
        values[f"{name}_bias_rad_s"] = round(bias, 6)
        said.append(f"{name} {math.degrees(bias):+.2f} degrees/s (noise {math.degrees(noise):.2f})")
    if not values:
        raise EchostepError("no gyro gives values: run echostep doctor")
    return {"gyro": values}, "Bias: " + ", ".join(said)


def bearings(heard: Heard) -> tuple[Floats, Floats]:
    """Times (n,) s and compass bearings (n,) rad, clockwise; invalid ones left out."""
    t_s = np.array(heard.ticks.get("Compass", []), float) / TICKS_PER_S
    bearing = np.array([c.bearing for c in heard.compass], float)
    good = bearing < 3600
    return t_s[good], np.radians(0.1 * bearing[good])


def find_mounting(heard: Heard) -> tuple[dict[str, Values], str]:
    """Which way round the belt's gyro is worn: the compass tells in a turn on the spot."""
    t_s, rate = gyro_rates(heard)
    belt = rate[:, GYROS.index("belt")]
    there = np.isfinite(belt)
    at_s, bearing = bearings(heard)
    if there.sum() < 100 or len(bearing) < 20:
        raise EchostepError("belt gyro or compass gives no values: run echostep doctor")
    t_s, belt = t_s[there], belt[there]
    turned = np.concatenate([[0.0], np.cumsum(np.diff(t_s) * 0.5 * (belt[1:] + belt[:-1]))])
    by_gyro = np.interp(at_s, t_s, turned)
    by_compass = -np.unwrap(bearing)  # counter-clockwise
    if np.ptp(by_compass) < FULL_TURN_RAD or np.ptp(by_gyro) < 0.5 * FULL_TURN_RAD:
        seen = f"{math.degrees(np.ptp(by_compass)):.0f} by the compass, {math.degrees(np.ptp(by_gyro)):.0f} by the belt gyro"
        raise EchostepError(
            f"the turn covers {seen} degrees: turn once round on the spot, slowly and evenly, and do it again"
        )
    reversed_ = bool(np.corrcoef(by_gyro, by_compass)[0, 1] < 0.0)
    return {"gyro": {"belt_reversed": reversed_}}, f"The belt gyro is worn {'upside down' if reversed_ else 'upright'}."


PARTS = {
    "gyros": Part("gyros", "Gyros: stand still, or lay everything on a table.", STILL_S, find_gyros),
    "mounting": Part("mounting", "Mounting: turn once round on the spot, slowly.", TURN_S, find_mounting),
}


def _sections(out: Path) -> dict[str, dict[str, Any]]:
    """What the file holds already; nothing when there is none."""
    if not out.exists():
        return {}
    text = read_settings(out)
    parse_settings(text, str(out))
    return tomllib.loads(text)


def _write(out: Path, sections: dict[str, dict[str, Any]]) -> None:
    lines = ["# Settings of echostep, with what echostep calibrate found."]
    for name, values in sections.items():
        lines += ["", f"[{name}]"]
        lines += [
            f"{key} = {str(value).lower() if isinstance(value, bool) else repr(value)}" for key, value in values.items()
        ]
    text = "\n".join(lines) + "\n"
    parse_settings(text, str(out))
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        out.write_text(text)
    except OSError as error:
        raise EchostepError(f"{out}: cannot write the settings: {error.strerror}") from error
