# SPDX-License-Identifier: MIT
"""Drawing of where each device is worn.

In: nothing. Out: SVG. Owns the places and the notes.
"""

from __future__ import annotations

from hardware.pen import SOFT, Pen

SKIN, CLOTH = "#e7eaee", "#d5dae1"
MTX, GYRO, BELT, RANGER, CABLE, HOST = "#be185d", "#c2410c", "#0b62d6", "#15803d", "#59636e", "#7c3aed"


def wearing() -> str:
    """The SVG."""
    pen = Pen(1170, 750, "How the system is worn")
    pen.label(30, 40, "How the system is worn", 22, bold=True)
    pen.label(
        30,
        62,
        "Right leg shown; the left one is as good (settings: foot_left_m). Axes are those printed on the devices.",
        13,
        ink=SOFT,
    )
    _side(pen, 250)
    _behind(pen, 850)
    return pen.svg()


def _limb(pen: Pen, points: list[tuple[float, float]], width: float, ink: str) -> None:
    pen.wire(points, ink, width)


def _device(pen: Pen, x: float, y: float, width: float, height: float, ink: str) -> None:
    pen.box(x - width / 2, y - height / 2, width, height, "#ffffff", ink)


def _label(pen: Pen, x: float, y: float, lines: tuple[str, ...], ink: str, anchor: str = "start") -> None:
    pen.label(x, y, lines[0], 14, anchor, ink, bold=True)
    for k, line in enumerate(lines[1:]):
        pen.label(x, y + 18 * (k + 1), line, 12, anchor, SOFT)


def _arrow(pen: Pen, x0: float, y0: float, x1: float, y1: float, ink: str) -> None:
    pen.wire([(x0, y0), (x1, y1)], ink, 2.4)
    length = ((x1 - x0) ** 2 + (y1 - y0) ** 2) ** 0.5
    ux, uy = (x1 - x0) / length, (y1 - y0) / length
    pen.wire(
        [(x1 - 9 * ux + 5 * uy, y1 - 9 * uy - 5 * ux), (x1, y1), (x1 - 9 * ux - 5 * uy, y1 - 9 * uy + 5 * ux)], ink, 2.4
    )


def _side(pen: Pen, x: float) -> None:
    """The wearer from the right side, facing the right of the page; `x` is the middle of the trunk."""
    pen.label(x, 100, "from the right", 14, "middle", SOFT)
    _limb(pen, [(x - 8, 420), (x - 22, 540), (x - 52, 672)], 40, "#eef0f3")  # the other leg
    _limb(pen, [(x - 52, 690), (x - 20, 698)], 22, "#eef0f3")
    pen.disc(x, 160, 36, SKIN, SKIN)
    _limb(pen, [(x, 225), (x - 2, 385)], 78, CLOTH)
    _limb(pen, [(x, 420), (x + 14, 540), (x + 6, 670)], 46, CLOTH)
    _limb(pen, [(x + 6, 700), (x + 56, 706)], 26, "#aab3bd")
    pen.box(x - 78, 230, 46, 110, "#ffffff", HOST)
    pen.wire([(x - 40, 340), (x - 40, 396)], CABLE, 2, "5 4")
    pen.wire([(x - 25, 404), (x + 8, 470), (x + 32, 590), (x + 26, 660), (x + 40, 690)], CABLE, 2, "5 4")
    pen.wire([(x - 46, 402), (x + 42, 402)], "#8c959f", 10)
    _device(pen, x - 40, 402, 26, 40, BELT)
    _device(pen, x, 402, 22, 30, RANGER)
    pen.disc(x, 402, 6, RANGER)
    _device(pen, x + 26, 478, 16, 30, GYRO)
    _device(pen, x + 32, 604, 16, 30, GYRO)
    _device(pen, x + 40, 690, 34, 16, MTX)
    _arrow(pen, x + 40, 690, x + 96, 697, MTX)
    pen.label(x + 100, 702, "x, to the toe", 12, ink=MTX)
    _label(pen, x + 80, 470, ("thigh gyro", "outer side, half-way up the thigh;", "its axis across the body"), GYRO)
    _label(
        pen, x + 80, 592, ("calf gyro", "outer side of the shank, below the knee;", "its axis across the body"), GYRO
    )
    _label(pen, x + 80, 660, ("MTx or foot board", "firmly on the instep, under the laces"), MTX)
    _label(pen, x + 80, 400, ("rangers", "one on each hip, see the other view"), RANGER)
    _label(pen, x - 96, 250, ("host", "laptop or phone", "in the backpack"), HOST, "end")
    _label(
        pen,
        x - 96,
        388,
        ("board", "on the belt, at the back,", "with belt gyro (axis up),", "compass and barometer"),
        BELT,
        "end",
    )
    _label(
        pen,
        x - 96,
        560,
        ("cables", "along the seam, with", "slack at hip and knee,", "taped at each device"),
        CABLE,
        "end",
    )


def _behind(pen: Pen, x: float) -> None:
    """The wearer from behind; `x` is the middle of the trunk."""
    pen.label(x, 100, "from behind", 14, "middle", SOFT)
    pen.disc(x, 160, 36, SKIN, SKIN)
    for side in (-1, 1):
        _limb(pen, [(x + side * 60, 236), (x + side * 72, 318)], 24, SKIN)
    pen.shape(
        f"M{x - 60} 236 Q{x - 56} 206 {x - 20} 204 L{x + 20} 204 Q{x + 56} 206 {x + 60} 236 L{x + 48} 420 L{x - 48} 420 Z",
        CLOTH,
    )
    for side in (-1, 1):
        _limb(pen, [(x + side * 26, 425), (x + side * 30, 540), (x + side * 30, 680)], 44, CLOTH)
        _limb(pen, [(x + side * 30, 704), (x + side * 34, 706)], 26, "#aab3bd")
    pen.wire([(x - 54, 402), (x + 54, 402)], "#8c959f", 10)
    pen.wire([(x + 20, 410), (x + 52, 440), (x + 56, 600), (x + 52, 690)], CABLE, 2, "5 4")
    for side in (-1, 1):
        pen.shape(
            f"M{x + side * 66} 402 L{x + side * 190} 338 A 140 140 0 0 {1 if side > 0 else 0} {x + side * 190} 466 Z",
            "#15803d1f",
        )
        _device(pen, x + side * 60, 402, 16, 26, RANGER)
        _arrow(pen, x + side * 70, 402, x + side * 170, 402, RANGER)
    _device(pen, x, 402, 46, 34, BELT)
    _device(pen, x + 54, 478, 12, 30, GYRO)
    _device(pen, x + 52, 604, 12, 30, GYRO)
    _label(pen, x - 250, 300, ("left ranger", "looks straight to the left"), RANGER)
    _label(pen, x + 110, 300, ("right ranger", "looks straight to the right"), RANGER)
    _label(pen, x - 250, 500, ("compass", "20 cm from keys, phone,", "buckle and batteries"), BELT)
    _label(pen, x + 110, 500, ("55 degrees wide", "keep arms, bag and jacket", "out of both cones"), RANGER)
    _label(pen, x - 250, 600, ("barometer", "a hole in the box, foam", "over it against wind"), BELT)
    _arrow(pen, x, 384, x, 318, BELT)
    pen.label(x, 306, "axis of the belt gyro", 12, "middle", BELT)
