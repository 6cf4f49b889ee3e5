# SPDX-License-Identifier: MIT
"""A minimal SVG writer: boxes, discs, wires, paths and lines of text.

In: coordinates in pixels, x to the right, y down. Out: the text of an SVG file. Owns the elements drawn so far.
"""

from __future__ import annotations

from html import escape

INK, PAPER, SOFT = "#1b1f24", "#ffffff", "#59636e"
FONT = "font-family='DejaVu Sans, Helvetica, Arial, sans-serif'"


class Pen:
    """Collects SVG elements; later ones lie on top."""

    def __init__(self, width: int, height: int, title: str) -> None:
        self._elements = [
            "<!-- SPDX-License-Identifier: MIT -->",
            f"<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {width} {height}' width='{width}' height='{height}' role='img'>",
            f"<title>{escape(title)}</title>",
            f"<rect width='{width}' height='{height}' fill='{PAPER}'/>",
        ]

    def label(
        self,
        x: float,
        y: float,
        text: str,
        size: int = 13,
        anchor: str = "start",
        ink: str = INK,
        *,
        bold: bool = False,
    ) -> None:
        """Write a line of text; (x, y) is on its base line, at its start, middle or end by `anchor`."""
        weight = " font-weight='bold'" if bold else ""
        self._elements.append(
            f"<text x='{x:g}' y='{y:g}' font-size='{size}' text-anchor='{anchor}' fill='{ink}' {FONT}{weight}>{escape(text)}</text>"
        )

    def box(self, x: float, y: float, width: float, height: float, fill: str = "#f3f5f8", ink: str = INK) -> None:
        """Draw a rectangle with round corners, (x, y) its upper left one."""
        self._elements.append(
            f"<rect x='{x:g}' y='{y:g}' width='{width:g}' height='{height:g}' rx='6' fill='{fill}' stroke='{ink}' stroke-width='1.6'/>"
        )

    def wire(self, points: list[tuple[float, float]], ink: str, width: float = 2.0, dash: str = "") -> None:
        """Draw a line through these points."""
        path = " ".join(f"{x:g},{y:g}" for x, y in points)
        dashed = f" stroke-dasharray='{dash}'" if dash else ""
        self._elements.append(
            f"<polyline points='{path}' fill='none' stroke='{ink}' stroke-width='{width:g}' stroke-linejoin='round' stroke-linecap='round'{dashed}/>"
        )

    def dot(self, x: float, y: float, ink: str) -> None:
        """Draw a joint of wires."""
        self._elements.append(f"<circle cx='{x:g}' cy='{y:g}' r='4' fill='{ink}'/>")

    def disc(self, x: float, y: float, radius: float, fill: str, ink: str = INK) -> None:
        """Draw a circle."""
        self._elements.append(
            f"<circle cx='{x:g}' cy='{y:g}' r='{radius:g}' fill='{fill}' stroke='{ink}' stroke-width='1.6'/>"
        )

    def shape(self, path: str, fill: str, ink: str = "none", width: float = 1.6) -> None:
        """Draw a path, given in the syntax of the attribute `d`."""
        self._elements.append(
            f"<path d='{path}' fill='{fill}' stroke='{ink}' stroke-width='{width:g}' stroke-linejoin='round'/>"
        )

    def svg(self) -> str:
        """The text of the file."""
        return "\n".join([*self._elements, "</svg>"]) + "\n"
