# SPDX-License-Identifier: MIT
"""CARMEN logs: laser scans with corrected poses, and the odometry between them [carmen.sourceforge.net, logger file format].

In: NAME.log or NAME.log.gz. Out: `CarmenLog`. Owns nothing. A file that is not such a log is answered by one EchostepError with file and line.

    FLASER n r1 ... rn x y theta ...    n ranges over 180 degrees from right to left (m); pose on the map (m, rad)
    ODOM x y theta ...                  pose by odometry; the one right after a scan repeats the scan's pose, those that follow count on from it

Other lines are ignored.
"""

from __future__ import annotations

import gzip
import math
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from echostep.arrays import Floats
from echostep.errors import EchostepError

# Assumed, all of them.
LONGEST_LINE = 100_000  # bytes
MOST_LINES = 2_000_000
MOST_SCANS = 20_000
BEAMS = (90, 1500)  # fewest and most of a scan
FEWEST_SCANS = 20
FARTHEST_M = 1e5  # greatest coordinate


@dataclass(frozen=True, slots=True)
class CarmenLog:
    """k scans of n beams: `range_m` (k, n), `pose` (k, 3) x, y, theta; `odometry[i]` (m, 3): poses counted on from scan i until the one after it."""

    name: str
    range_m: Floats
    pose: Floats
    odometry: tuple[Floats, ...]

    @property
    def angles_rad(self) -> Floats:
        """Angle of each beam from straight ahead (n,), left positive; an even number of beams lacks the leftmost."""
        beams = self.range_m.shape[1]
        step = math.pi / (beams - beams % 2)
        return -0.5 * math.pi + step * np.arange(beams)


def logs_in(folder: Path) -> list[Path]:
    """The logs of a folder by name; raises EchostepError where there are none."""
    if not folder.is_dir():
        raise EchostepError(f"{folder}: no such folder: --data names a folder of CARMEN logs (*.log, *.log.gz)")
    paths = sorted([*folder.glob("*.log"), *folder.glob("*.log.gz")])
    if not paths:
        raise EchostepError(f"{folder}: no CARMEN log (*.log, *.log.gz) in there")
    names = [name_of(path) for path in paths]
    for path, name in zip(paths, names, strict=True):
        if names.count(name) > 1:
            raise EchostepError(f"{path}: two logs are named {name}: rename one")
    return paths


def name_of(path: Path) -> str:
    """Name of a log in the table: that of the file without its endings."""
    return path.name.removesuffix(".gz").removesuffix(".log").removesuffix("-corrected")


def read_log(path: Path) -> CarmenLog:
    """Read a log; raises EchostepError that names file and line."""
    scans: list[Floats] = []
    poses: list[list[float]] = []
    odometry: list[list[list[float]]] = []
    beams = 0
    for number, line in _lines(path):
        words = line.split()
        kind = words[0] if words else b""
        if kind == b"ODOM" and odometry:
            odometry[-1].append(_numbers(words[1:4], 3, FARTHEST_M, path, number))
        elif kind == b"FLASER":
            count = _count(words, path, number)
            if beams not in (0, count):
                raise EchostepError(f"{path}: line {number}: a scan of {count} beams after scans of {beams}")
            beams = count
            values = _numbers(words[2 : 5 + beams], beams + 3, FARTHEST_M, path, number)
            scans.append(np.array(values[:beams]))
            poses.append(values[beams:])
            odometry.append([])
            if len(scans) > MOST_SCANS:
                raise EchostepError(f"{path}: line {number}: more than {MOST_SCANS} scans")
    if len(scans) < FEWEST_SCANS:
        raise EchostepError(f"{path}: {len(scans)} laser scans (FLASER lines), at least {FEWEST_SCANS} are needed")
    since = tuple(np.array(o).reshape(-1, 3) for o in odometry)
    return CarmenLog(name_of(path), np.array(scans), np.array(poses), since)


def _lines(path: Path) -> Iterator[tuple[int, bytes]]:
    """Numbered lines, from 1."""
    number = 0
    try:
        with gzip.open(path, "rb") if path.suffix == ".gz" else path.open("rb") as file:
            while line := file.readline(LONGEST_LINE + 1):
                number += 1
                if len(line) > LONGEST_LINE:
                    raise EchostepError(f"{path}: line {number}: longer than {LONGEST_LINE} bytes: not a CARMEN log")
                if number > MOST_LINES:
                    raise EchostepError(f"{path}: more than {MOST_LINES} lines")
                yield number, line
    except (OSError, EOFError, zlib.error) as error:
        raise EchostepError(f"{path}: cannot be read after line {number}: {error}") from error


def _count(words: list[bytes], path: Path, number: int) -> int:
    """Number of beams of a FLASER line."""
    count = int(words[1]) if len(words) > 1 and words[1].isdigit() and len(words[1]) < 6 else 0
    if not BEAMS[0] <= count <= BEAMS[1]:
        raise EchostepError(f"{path}: line {number}: FLASER needs a number of beams from {BEAMS[0]} to {BEAMS[1]}")
    return count


def _numbers(words: list[bytes], count: int, largest: float, path: Path, number: int) -> list[float]:
    """So many finite numbers."""
    try:
        values = [float(word) for word in words]
    except ValueError:
        values = []
    if len(values) != count or not all(abs(v) <= largest for v in values):
        raise EchostepError(f"{path}: line {number}: {count} numbers up to {largest:g} expected")
    return values
