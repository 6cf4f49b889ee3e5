# SPDX-License-Identifier: MIT
"""The house as IMDF, a map of ROS, a picture, and plan.json."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageDraw

from plan.drawings.drawn_houses import corners
from plan.habits.house import HIGH, ROOMS, STAIRS, STOREYS, WIDE, Line, Move, axes, boxes, doors_on

Rows = dict[str, list[dict[str, Any]]]


def area(move: Move, box: Line, **about: Any) -> dict[str, Any]:
    """A rectangle on the Earth; the property id is the feature's id."""
    ring = corners(box)
    return feature({"type": "Polygon", "coordinates": [[move.degrees(*p) for p in (*ring, ring[0])]]}, **about)


def feature(geometry: Any, id_: str = "", **about: Any) -> dict[str, Any]:
    return {"type": "Feature", "id": id_, "geometry": geometry, "properties": about}


def collection(path: Path, features: list[Any], **more: Any) -> None:
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features} | more))


def imdf(folder: Path, move: Move, change: Callable[[Rows], Any] = id, **more: Any) -> Path:
    """An archive as a folder; `change` alters its features by kind."""
    rows: Rows = {"level": [], "unit": [], "opening": []}
    for k in STOREYS:
        on = {"level_id": f"L{k}"}
        rows["level"].append(area(move, (0, 0, WIDE, HIGH), id_=f"L{k}", ordinal=k, name={"en": f"Floor {k}"}))
        rows["unit"] += [
            area(move, box, id_=name, category="room", name={"en": name}, **on) for name, box in ROOMS.items()
        ]
        rows["unit"].append(area(move, STAIRS, id_=f"stairs{k}", category="stairs", **on))
        for a, b, c, d in doors_on(k):
            line = {"type": "LineString", "coordinates": [move.degrees(a, b), move.degrees(c, d)]}
            rows["opening"].append(feature(line, f"o{k}{a}", category="pedestrian", **on))
    change(rows)
    for kind, features in rows.items():
        collection(folder / f"{kind}.geojson", move.ordered(features), **more)
    (folder / "manifest.json").write_text('{"version": "1.0.0"}')
    return folder


def names_turned(rows: Rows) -> None:
    """Names in another order than the ordinals."""
    for feature, name in zip(rows["level"], ("First floor", "Ground floor", "Level 2"), strict=True):
        feature["properties"]["name"] = {"en": name}


def own(folder: Path, move: Move) -> Path:
    def levels(k: int) -> dict[str, Any]:
        walls = [[*move(*line[:2]), *move(*line[2:])] for line in axes(k)]
        doors = [{"line": [*move(*line[:2]), *move(*line[2:])]} for line in doors_on(k)]
        rooms = [{"name": name, "at": list(move(box[0] + 2, 2))} for name, box in ROOMS.items()]
        lists: dict[str, list[Any]] = {"walls": walls, "doors": doors, "rooms": rooms}
        return {"name": f"F{k}", "height_m": 3.0 * k} | {key: move.ordered(rows) for key, rows in lists.items()}

    way = {"kind": "stairs", "name": "S", "levels": [0, 1, 2], "outline": [list(move(*p)) for p in corners(STAIRS)]}
    tree = {"echostep_plan": 1, "name": "House", "levels": [levels(k) for k in STOREYS], "connectors": [way]}
    (folder / "plan.json").write_text(json.dumps(tree))
    return folder / "plan.json"


def pixels(pixel: float = 0.05) -> np.ndarray:
    """The lowest storey as grey values: ink 0, paper 254; 20 pixels around it."""
    image = Image.new("L", (int(WIDE / pixel) + 40, int(HIGH / pixel) + 40), 254)
    for x0, y0, x1, y1 in np.array(boxes(0)) / pixel:
        ImageDraw.Draw(image).rectangle((x0 + 20, image.height - 20 - y1, x1 + 19, image.height - 21 - y0), fill=0)
    return np.asarray(image)


def see_through(ink: int = 0) -> Image.Image:
    """The same as ink of this grey on transparent paper."""
    grey = pixels()
    return Image.fromarray(np.dstack((*[np.full_like(grey, ink)] * 3, np.where(grey > 0, 0, 255).astype(np.uint8))))


def deep(most: int = 257) -> Image.Image:
    """The same with 16 bits a pixel."""
    return Image.fromarray(pixels().astype(np.uint16) * most)


def turned(how: int) -> tuple[Image.Image, Image.Exif]:
    """The same as a camera stores it that is turned, and what it says of that."""
    back = (None, None, 0, 3, 1, 5, 2, 6, 4)[how]  # what `Image.transpose` undoes of orientations 1 to 8
    back = {6: Image.Transpose.ROTATE_90, 8: Image.Transpose.ROTATE_270}.get(how, back)
    about, image = Image.Exif(), Image.fromarray(pixels())
    about[0x0112] = how
    return (image if back is None else image.transpose(Image.Transpose(back))), about


def askew(degrees: float) -> Image.Image:
    """The same on a scanner that it does not lie straight on."""
    return Image.fromarray(pixels()).rotate(degrees, Image.Resampling.BICUBIC, expand=True, fillcolor=254)


def ros(folder: Path, text: str = "", image: Any = None, name: str = "map.pgm") -> Path:
    """A map and its yaml, whose usual fields `text` replaces."""
    (Image.fromarray(pixels()) if image is None else image).save(folder / name)
    keys = {line.partition(":")[0].strip(" \"'{") for line in text.splitlines()}
    usual = {"image": name, "resolution": "0.05", "origin": "[0.0, 0.0, 0.0]", "negate": "0", "occupied_thresh": "0.65"}
    lines = [f"{key}: {value}" for key, value in usual.items() if key not in keys and not text.startswith("{")]
    (folder / "map.yaml").write_text("\n".join([*lines, text, ""]))
    return folder / "map.yaml"
