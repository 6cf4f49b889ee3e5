# SPDX-License-Identifier: MIT
"""The printed boxes (`make hardware`): each part rendered from its OpenSCAD source to STL, and checked to be a closed surface.

In: firmware/hardware/boxes/*.scad; the program openscad. Out: NAME-PART.stl beside the source; sizes on standard output, exit status 1 when a
surface is not closed. Owns nothing.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from collections import Counter
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hardware import HARDWARE

BOXES = HARDWARE / "boxes"
NAMES = ("belt_box", "ranger_holder", "imu_clip", "ankle_box")
PARTS = ("box", "lid")
Triangles = NDArray[np.float64]


def render(name: str, part: str, folder: Path) -> Triangles:
    """Render a part to NAME-PART.stl in a folder by OpenSCAD, and read it."""
    path = folder / f"{name}-{part}.stl"
    drawn = ("-D", f'part="{part}"', str(BOXES / f"{name}.scad"))
    command = ["openscad", "-q", "--export-format", "binstl", "-o", str(path), *drawn]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode or done.stderr:
        raise SystemExit(f"{name}, {part}: {done.stderr}")
    return read_stl(path)


def read_stl(path: Path) -> Triangles:
    """Corners (n, 3, 3) of the triangles of a binary STL file, mm: 80 bytes, a count, and 50 bytes a facet [3D Systems, 1989]."""
    facets = np.frombuffer(path.read_bytes()[84:], np.uint8).reshape(-1, 50)
    return facets[:, 12:48].copy().view("<f4").reshape(-1, 3, 3).astype(float)


def is_closed(triangles: Triangles) -> bool:
    """Whether the surface encloses a volume: each edge is passed once in each direction."""
    _, corners = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    edges = Counter(
        (int(a), int(b)) for face in corners.reshape(-1, 3) for a, b in zip(face, np.roll(face, -1), strict=True)
    )
    whole = all(count == 1 and a != b and (b, a) in edges for (a, b), count in edges.items())
    return whole and volume(triangles) > 0.0


def volume(triangles: Triangles) -> float:
    """Enclosed volume, mm3, by the divergence theorem."""
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0)


def size(triangles: Triangles) -> NDArray[np.float64]:
    """Lengths (3,) of the box around a part, mm."""
    lengths: NDArray[np.float64] = np.ptp(triangles.reshape(-1, 3), axis=0)
    return lengths


def main() -> int:
    """Render and check all boxes."""
    argparse.ArgumentParser(description=__doc__.partition("\n")[0]).parse_args()
    sound = True
    for name in NAMES:
        for part in PARTS:
            triangles = render(name, part, BOXES)
            x, y, z = size(triangles)
            closed = is_closed(triangles)
            sound &= closed
            words = "closed" if closed else "not closed"
            print(f"{name} {part}: {x:.1f} x {y:.1f} x {z:.1f} mm, {volume(triangles) / 1000:.1f} cm3, {words}")
    return 0 if sound else 1


if __name__ == "__main__":
    sys.exit(main())
