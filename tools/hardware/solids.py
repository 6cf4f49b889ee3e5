# SPDX-License-Identifier: MIT
"""Triangles of a printed part: read from OpenSCAD's STL, checked to be a closed surface, written for a printer, drawn.

In: an ASCII STL file, mm. Out: triangles (n, 3, 3); a binary STL file; faults of the surface; its volume; a shaded picture. Owns nothing.
"""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Triangles = NDArray[np.float64]
LIGHT = np.array([-0.35, 0.65, 0.68])  # direction to the light, in the picture's axes
# Grey of the background, colour of a face towards the light
PAPER, SHADE, EDGE = (255.0, np.array([125.0, 165.0, 200.0]), 0.25)


def read_stl(path: Path) -> Triangles:
    """The triangles of an ASCII STL file."""
    numbers = re.findall(r"vertex (\S+) (\S+) (\S+)", path.read_text())
    return np.array(numbers, dtype=float).reshape(-1, 3, 3)


def write_stl(path: Path, triangles: Triangles, header: str) -> None:
    """Write a binary STL file; its normals are zero: a reader computes them from the corners."""
    facets = np.zeros(len(triangles), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("unused", "<u2")])
    facets["corners"] = triangles
    path.write_bytes(header.encode().ljust(80) + np.uint32(len(facets)).tobytes() + facets.tobytes())


def faults(triangles: Triangles) -> list[str]:
    """What keeps a surface from being closed and oriented: each edge must be passed once in each direction."""
    corners, index = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    faces = index.reshape(-1, 3)
    edges = Counter((int(a), int(b)) for face in faces for a, b in zip(face, np.roll(face, -1), strict=True))
    found = []
    if any(a == b for a, b in edges):
        found.append("a triangle without an area")
    open_edges = sum(count != edges.get((b, a), 0) for (a, b), count in edges.items())
    if open_edges:
        found.append(f"{open_edges} open edges")
    if any(count > 1 for count in edges.values()):
        found.append(f"{sum(count > 1 for count in edges.values())} edges of more than two faces")
    if not len(corners) or volume(triangles) <= 0.0:
        found.append("no volume")
    return found


def volume(triangles: Triangles) -> float:
    """Enclosed volume, mm3, by the divergence theorem."""
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0)


def picture(triangles: Triangles, width: int) -> NDArray[np.uint8]:
    """A part seen from above, from the front and the right, in parallel projection; `width` in pixels, doubled while drawing."""
    turned = triangles @ _view().T
    low, high = turned.reshape(-1, 3).min(axis=0), turned.reshape(-1, 3).max(axis=0)
    scale = 2 * (width - 20) / (high[0] - low[0])
    height = int(np.ceil(scale * (high[1] - low[1]) / 2)) + 20
    turned = (turned - [low[0], high[1], 0.0]) * [scale, -scale, 1.0] + [20.0, 20.0, 0.0]
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]) @ _view().T
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    nearest = _nearest(turned, 2 * width, 2 * height)
    shade = 0.45 + 0.55 * np.clip(normals @ LIGHT, 0.0, 1.0)
    seen = nearest >= 0
    image = np.full((2 * height, 2 * width, 3), PAPER)
    image[seen] = shade[nearest[seen], None] * SHADE
    image[_edges(nearest, normals)] *= EDGE
    return image.reshape(height, 2, width, 2, 3).mean(axis=(1, 3)).astype(np.uint8)


def _view() -> NDArray[np.float64]:
    """Rotation to the picture's axes: right, up, to the eye."""
    turn, tilt = np.radians(30.0), np.radians(52.0)
    about_z = np.array([[np.cos(turn), np.sin(turn), 0.0], [-np.sin(turn), np.cos(turn), 0.0], [0.0, 0.0, 1.0]])
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, np.sin(tilt), np.cos(tilt)], [0.0, -np.cos(tilt), np.sin(tilt)]])
    return about_x @ about_z


def _nearest(points: Triangles, width: int, height: int) -> NDArray[np.int64]:
    """The triangle nearest to the eye in each pixel; -1 without one. A depth buffer, a triangle at a time."""
    depth = np.full((height, width), -np.inf)
    nearest = np.full((height, width), -1)
    for number, (a, b, c) in enumerate(points):
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if area >= 0.0:  # it looks away, y being down
            continue
        low = np.floor(np.min([a, b, c], axis=0)).astype(int)
        high = np.ceil(np.max([a, b, c], axis=0)).astype(int)
        y, x = np.mgrid[low[1] : high[1] + 1, low[0] : high[0] + 1] + 0.5
        u = ((b[0] - x) * (c[1] - y) - (b[1] - y) * (c[0] - x)) / area
        v = ((c[0] - x) * (a[1] - y) - (c[1] - y) * (a[0] - x)) / area
        z = u * a[2] + v * b[2] + (1.0 - u - v) * c[2]
        part = (slice(low[1], high[1] + 1), slice(low[0], high[0] + 1))
        inside = (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1.0 + 1e-9) & (z > depth[part])
        depth[part][inside] = z[inside]
        nearest[part][inside] = number
    return nearest


def _edges(nearest: NDArray[np.int64], normals: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Pixels at which the surface bends by more than 30 degrees, or ends."""
    direction = np.where((nearest >= 0)[..., None], normals[nearest], 0.0)
    edges = np.zeros(nearest.shape, dtype=bool)
    for axis in (0, 1):
        same = np.sum(direction * np.roll(direction, 1, axis=axis), axis=-1)
        one_seen = (nearest >= 0) | (np.roll(nearest, 1, axis=axis) >= 0)
        edges |= (same < np.cos(np.radians(30.0))) & one_seen
    return edges
