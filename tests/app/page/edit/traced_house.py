# SPDX-License-Identifier: MIT
"""A scanned plan of 30 rooms on both sides of a corridor, with what a scan has besides walls: furniture, words, hatching.

Metres, x right, y up, the lower left corner of the picture is the origin. Three rooms have a short wall of their own, so that no rectangle about a
whole row of rooms is right.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from PIL import Image, ImageDraw

PIXEL_M = 0.04
SIZE_M = 62.0, 14.4
ROOMS = 15  # on each side
ROOM_M = 4.0  # from the middle of a wall to the next one
ROWS = (1.2, 6.0), (8.4, 13.2)  # y of the faces of the rooms' walls, below and above the corridor
STUBS = (2, 0), (9, 0), (6, 1)  # column and row of the rooms with a wall of their own
INK, PAPER = 40, 230

Box = tuple[float, float, float, float]
Line = list[tuple[float, float]]


def room_middles() -> list[tuple[float, float]]:
    """A place in each room, the lower row first."""
    return [(left(k) + 2.0, (low + high) / 2) for low, high in ROWS for k in range(ROOMS)]


def left(column: int) -> float:
    """The inner face of a room's left wall in x."""
    return 1.1 + ROOM_M * column


def walls() -> Iterator[Box]:
    """Walls of 0.2 m; each room has a gap of 0.9 m towards the corridor."""
    yield from ((1.0, 1.0, 61.0, 1.2), (1.0, 13.2, 61.0, 13.4), (1.0, 1.0, 1.2, 13.4), (60.8, 1.0, 61.0, 13.4))
    for low, high in ROWS:
        corridor = high if low < SIZE_M[1] / 2 else low - 0.2
        for k in range(ROOMS):
            x = 1.0 + ROOM_M * k
            yield from ((x, corridor, x + 1.6, corridor + 0.2), (x + 2.5, corridor, x + ROOM_M, corridor + 0.2))
        for k in range(1, ROOMS):
            yield left(k) - 0.2, low - 0.1, left(k), high + 0.1
    for k, row in STUBS:
        yield left(k), ROWS[row][0] + 2.2, left(k) + 1.0, ROWS[row][0] + 2.4


def clutter() -> Iterator[Line]:
    """A desk with its chair, a word in one go, or hatching, in turns."""
    for row, (low, _) in enumerate(ROWS):
        for k in range(ROOMS):
            x, y = left(k) + 0.6, low + 0.6
            if (k + row) % 3 == 0:
                yield [(x, y), (x + 1.6, y), (x + 1.6, y + 0.7), (x, y + 0.7), (x, y)]
                yield [(x + 0.4, y + 0.9), (x + 1.1, y + 0.9), (x + 0.8, y + 1.3), (x + 0.4, y + 0.9)]
            elif (k + row) % 3 == 1:
                yield [(x + 0.25 * i, y + 0.6 * (i % 2)) for i in range(9)]
            else:
                yield from ([(x + 0.25 * i, y), (x + 0.5 + 0.25 * i, y + 1.3)] for i in range(8))
    for k, row in STUBS:  # round the short wall
        x, y = left(k), ROWS[row][0] + 2.3
        yield [(x + 0.3, y + 0.4), (x + 1.4, y + 0.4), (x + 1.4, y - 0.4)]
    yield from ([(20.0 + i, 6.6), (21.0 + i, 7.8)] for i in range(6))  # in the corridor
    yield [(30.0, 11.6), (30.0, 13.3)]  # up to the wall


def draw(path: Path, *, cluttered: bool) -> Path:
    """Write the picture."""
    width, height = (round(size / PIXEL_M) for size in SIZE_M)
    image = Image.new("L", (width, height), PAPER)
    pen = ImageDraw.Draw(image)
    for x0, y0, x1, y1 in walls():
        left_px, right_px = round(x0 / PIXEL_M), round(x1 / PIXEL_M) - 1
        pen.rectangle((left_px, round(height - y1 / PIXEL_M), right_px, round(height - y0 / PIXEL_M) - 1), fill=INK)
    for line in clutter() if cluttered else ():
        pen.line([(x / PIXEL_M, height - y / PIXEL_M) for x, y in line], fill=INK, width=2)
    image.save(path)
    return path
