# SPDX-License-Identifier: MIT
"""Each importer against each habit of those who write its files: right, or asked (an error or note with the next step); never silently wrong."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ifcopenshell.api import georeference
from PIL import Image
from pyproj import Transformer

from echostep.errors import EchostepError
from echostep.plan import load_plan
from echostep_app.plan.importers.formats import import_plan
from echostep_app.plan.importers.report import Hints, ImportReport
from echostep_app.plan.importers.summary import summary
from plan.drawings import drawn_offices as offices
from plan.habits import drawn_house as dxf
from plan.habits import model_house as model
from plan.habits import osm_house as osm
from plan.habits import other_houses as other
from plan.habits.house import FAR, MOVES, Move, Right

STAY = Move()
ONE = Right(thick=0.2, names=False, levels=1, stairs=False)
EARTH = Right(earth=True)


@dataclass(frozen=True)
class Cell:
    """A file of an importer in a habit. `asks`: what the import says instead of being right; empty where it must be right."""

    importer: str
    habit: str
    write: Callable[[Path, Move], Path | Sequence[Path]]
    move: Move = STAY
    asks: str = ""
    right: Right = EARTH
    hints: dict[str, Any] = field(default_factory=dict)


def cells(importer: str, habit: str, *writes: Any, asks: str = "", right: Right = EARTH, **hints: Any) -> list[Cell]:
    return [Cell(importer, habit, write, asks=asks, right=right, hints=hints) for write in writes]


def moved(importer: str, write: Any, right: Right = EARTH, moves: Sequence[Move] = MOVES, **hints: Any) -> list[Cell]:
    return [Cell(importer, "far" if move in FAR else "plain", write, move, "", right, hints) for move in (STAY, *moves)]


def rows(kind: str, change: Callable[[list[Any]], list[Any]] = list, **about: Any) -> Any:
    return lambda folder, move: osm.write(folder, kind, change(osm.house(move, **about)), move)


def geojson(pack: Callable[[Any], Any], change: Callable[[list[Any]], list[Any]] = list, **more: Any) -> Any:
    def write(folder: Path, move: Move) -> Path:
        (folder / "a.geojson").write_text(
            json.dumps(json.loads(osm.as_geojson(change(osm.house(move)), move, pack)) | more)
        )
        return folder / "a.geojson"

    return write


def in_system(name: str, write: Callable[..., Any]) -> Any:
    """All coordinates in another coordinate system, which the field crs names."""
    transform = Transformer.from_crs("EPSG:4326", name, always_xy=True).transform

    def there(value: Any) -> Any:
        return list(transform(*value)) if isinstance(value[0], float) else [there(one) for one in value]

    def pack(feature: Any) -> Any:
        feature["geometry"]["coordinates"] = there(feature["geometry"]["coordinates"])
        return feature

    return write(pack, crs={"type": "name", "properties": {"name": name}})


def exchanged(feature: Any) -> Any:
    """Latitude before longitude."""

    def there(value: Any) -> Any:
        return value[::-1] if isinstance(value[0], float) else [there(one) for one in value]

    feature["geometry"]["coordinates"] = there(feature["geometry"]["coordinates"])
    return feature


def twice(files: Any, by: float = 0.0) -> None:
    """Each opening once more from its other end, beside the first one."""
    for one in list(files["opening"]):
        ends = [[x + by / 67_114.0, y + by / 111_315.0] for x, y in one["geometry"]["coordinates"][::-1]]
        files["opening"].append(one | {"id": one["id"] + "again", "geometry": one["geometry"] | {"coordinates": ends}})


def imdf_of(change: Any, **more: Any) -> Any:
    def each(files: Any) -> None:
        for features in files.values():
            features[:] = [change(feature) for feature in features]

    return partial(other.imdf, change=each, **more)


def collected(feature: Any) -> Any:
    inner = {"type": "GeometryCollection", "geometries": [feature["geometry"]]}
    return feature | {"geometry": {"type": "GeometryCollection", "geometries": [inner]}}


def manifold(feature: Any) -> Any:
    shape = feature["geometry"]
    return feature | {"geometry": {"type": f"Multi{shape['type']}", "coordinates": [shape["coordinates"]]}}


def other_tags(feature: Any) -> Any:
    packed = ",".join(f'"{key}"=>"{value}"' for key, value in feature["properties"].items())
    return feature | {"properties": {"osm_id": "1", "other_tags": packed}}


def number_levels(feature: Any) -> Any:
    tags = feature["properties"]
    return feature | {"properties": {"tags": json.dumps(tags | {"level": [int(tags["level"])]})}}


def across(mark: dict[str, Any]) -> Callable[[list[Any]], list[Any]]:
    """A wall across the office, marked as deleted."""
    return lambda made: [
        *made,
        {"type": "way", "id": 500, "nodes": [made[0]["id"], made[3]["id"]], "tags": {"indoor": "wall", "level": "0"}}
        | mark,
    ]


def lacking(made: list[Any]) -> list[Any]:
    return [
        row | {"nodes": [row["nodes"][0], 4_000_000, *row["nodes"][1:]]} if row["type"] == "way" else row
        for row in made
    ]


def shifted(feature: Any) -> Any:
    """Doors 3e-8 degrees beside the walls' corners."""
    shape = feature["geometry"]
    return (
        feature | {"geometry": shape | {"coordinates": [c + 3e-8 for c in shape["coordinates"]]}}
        if shape["type"] == "Point"
        else feature
    )


OSM = [
    *(cell for kind in osm.WRITERS for cell in (
        *moved(kind, rows(kind)),
        *cells(kind, "no level", rows(kind, partial(osm.changed, level=None)), asks="nothing is tagged indoor"),
        *cells(kind, "no level", rows(kind, lambda made: [r if r["type"] == "way" else osm.changed([r], level=None)[0] for r in made])),
        *cells(kind, "level ranges", *(rows(kind, level=tags) for tags in (
            {"level": "0;1;2"}, {"level": "0-2"}, {"level": "0 ; 1-2;"}, {"level": "0", "repeat_on": "1;2"}, {"level": "0", "repeat_on": "1-2"},
        ))),
        *cells(kind, "level ranges", rows(kind, level={"level": "0,1,2"}), rows(kind, level={"level": "0..2"}), asks="write level=0;1 or level=0-2"),
        *cells(kind, "contradictions", rows(kind, level={"level": "0-2", "building": "yes", "building:levels": "2"}), asks="building:levels=2, but"),
        *cells(kind, "spellings", rows(kind, sign=-1), rows(kind, entrance="entrance")),
        *cells(kind, "units", rows(kind, partial(osm.tagged, width="90 cm"))),
        *cells(kind, "units", *(rows(kind, partial(osm.tagged, width=wide)) for wide in ("90", "900", "wide")), asks="write it in metres"),
    )),
    *(cell for kind in ("osm", "json") for cell in (
        *cells(kind, "hidden", *(rows(kind, across(mark)) for mark in ({"action": "delete"}, {"visible": False}))),
        *cells(kind, "bad references", rows(kind, lacking), rows(kind, osm.relations)),
        *cells(kind, "packed", *(rows(kind, change) for change in (
            osm.with_geometry, partial(osm.with_geometry, ids=False), partial(osm.relations, geometry=True),
        ))),
    )),
    *cells("geojson", "packed", *map(geojson, (collected, manifold, other_tags, number_levels))),
    *cells("geojson", "bad references", geojson(shifted)),
    *cells("geojson", "datum", *(in_system(name, geojson) for name in ("EPSG:4314", "urn:ogc:def:crs:EPSG::4277", "urn:ogc:def:crs:OGC:1.3:CRS84"))),
    *cells("geojson", "projected", in_system("EPSG:25832", geojson), asks="save it as EPSG:4326"),
    Cell("geojson", "exchanged", geojson(exchanged), Move(turn=0.3), asks="exchanged"),
]  # fmt: skip


def altered(change: Any) -> Any:
    return partial(other.imdf, change=change)


def stale(files: Any, kind: str, count: int) -> None:
    for feature in files[kind][:count]:
        feature["properties"]["level_id"] = "old"


def by_number(feature: Any) -> Any:
    about = feature["properties"]
    on = {"level_id": int(about["level_id"][1:])} if "level_id" in about else {"id": int(feature["id"][1:])}
    return {key: value for key, value in feature.items() if key != "id"} | {"properties": about | on}


def loud(feature: Any) -> Any:
    about = feature["properties"]
    return feature | {"properties": about | {"category": about.get("category", "").upper()}}


def beside(by: float) -> Any:
    """Openings beside their walls."""

    def change(files: Any) -> None:
        for feature in files["opening"]:
            ends = feature["geometry"]["coordinates"]
            x, y = (by / 67_114.0, 0.0) if ends[0][0] == ends[1][0] else (0.0, by / 111_315.0)
            feature["geometry"]["coordinates"] = [[a + x, b + y] for a, b in ends]

    return altered(change)


IMDF = [
    *moved("imdf", other.imdf),
    *cells("imdf", "packed", *map(imdf_of, (collected, manifold))),
    *cells("imdf", "spellings", *map(imdf_of, (by_number, loud))),
    *cells("imdf", "datum", in_system("EPSG:4314", imdf_of)),
    *cells("imdf", "projected", in_system("EPSG:25832", imdf_of), asks="save it as EPSG:4326"),
    Cell("imdf", "exchanged", imdf_of(exchanged), Move(turn=-0.2), asks="exchanged"),
    *cells("imdf", "twice", altered(twice), altered(partial(twice, by=0.05))),
    *cells("imdf", "bad references", *(altered(partial(stale, kind="unit", count=n)) for n in (1, 9)), asks="export all files again"),
    *cells("imdf", "bad references", altered(lambda files: files.pop("unit")), asks="export all files again"),
    *cells("imdf", "no level", altered(lambda files: files["opening"][0]["properties"].pop("level_id")), asks="1 of 4 are of levels"),
    *cells("imdf", "no level", altered(lambda files: files.pop("level")), asks=r"no level\.geojson in it"),
    *cells("imdf", "thick walls", beside(0.08), beside(0.19)),
    *cells("imdf", "thick walls", beside(0.4), asks="openings lie in no wall"),
    *cells("imdf", "copied storeys", altered(lambda files: [f["properties"].update(ordinal=0) for f in files["level"]]), asks="m apart"),
    *cells("imdf", "contradictions", altered(other.names_turned), asks="by their names the storeys are Ground floor, First floor, Level 2"),
    *moved("own", other.own, Right()),
]  # fmt: skip


def raw() -> Image.Image:
    return Image.fromarray(np.where(other.pixels() > 0, 0, 100).astype(np.uint8))


def mapped(*texts: str, image: Any = None, name: str = "map.pgm") -> list[Any]:
    return [
        lambda folder, _move, text=text: other.ros(folder, text, image() if image else None, name) for text in texts
    ]


def picture(make: Callable[[], Image.Image], name: str = "a.png", **about: Any) -> Any:
    def write(folder: Path, _move: Move) -> Path:
        make().save(folder / name, **about)
        return folder / name

    return write


def camera(how: int, name: str) -> Any:
    image, about = other.turned(how)
    return picture(lambda: image, name, exif=about, quality=97)


RASTERS = [
    *cells("ros", "plain", *mapped("", "mode: Trinary", "mode: scale", 'mode: "trinary"'), right=ONE),
    *(Cell("ros", "plain", mapped(f"origin: [1.5, -2, {turn}]")[0], Move(turn=turn), right=ONE) for turn in (0.3, -2.0)),
    *(Cell("ros", "far", mapped(f"origin: [-3e5, 6.0e+6, {turn}]")[0], Move(turn=turn), right=ONE) for turn in (0.0, 0.3)),
    *cells("ros", "spellings", *mapped(
        "negate: false", "negate: no", "negate: ~", "negate:", '"resolution": 0.05', "resolution : 5e-2 # metres", "origin:\n- 0.0\n- 0.0\n- 0.0",
        "origin: [0.0,\n  0.0, 0.0]", "---\nimage: './map.pgm'", "{image: map.pgm, resolution: 0.05, origin: [0, 0, 0]}",
    ), right=ONE),
    *cells("ros", "spellings", *mapped("occupied_thresh: 65", "mode: new", "resolution: x"), asks=r"map\.yaml: (occupied_thresh|mode|resolution): "),
    *cells("ros", "pictures", *mapped("negate: true", "negate: 1", image=lambda: Image.fromarray(255 - other.pixels())), right=ONE),
    *cells("ros", "pictures", *mapped("", image=other.see_through, name="a.png"), *mapped("", image=other.deep, name="a.png"), right=ONE),
    *cells("ros", "pictures", *mapped("mode: raw", image=raw), *mapped("mode: Raw", image=raw, name="a.png"), right=ONE),
    *cells("picture", "plain", picture(lambda: Image.fromarray(other.pixels())), right=ONE, scale_m=0.05),
    *cells("picture", "pictures", *(camera(how, f"a.{kind}") for how in range(1, 9) for kind in ("jpg", "webp")), right=ONE, scale_m=0.05),
    *cells(
        "picture", "pictures", picture(other.see_through), picture(lambda: other.see_through(255)),
        picture(lambda: other.see_through().convert("LA")),
        picture(other.deep), picture(other.deep, "a.tif"), picture(lambda: Image.fromarray(255 - other.pixels())),
        picture(lambda: Image.fromarray(other.pixels()).convert("CMYK"), "a.tif"), right=ONE, scale_m=0.05,
    ),
    *(Cell("picture", "turned", picture(partial(other.askew, angle)), Move(turn=math.radians(angle)), right=ONE, hints={"scale_m": 0.05})
      for angle in (10, 30, -17, 60, 75)),
    *cells("picture", "units", picture(lambda: Image.fromarray(other.pixels())), asks="--scale"),
]  # fmt: skip


def drawn(**about: Any) -> Any:
    return partial(dxf.files, **about)


THICK, SOLID = Right(thick=0.2), Right(thick=0.2, earth=True)
INSUNITS = {1: 0.0254, 2: 0.3048, 4: 0.001, 5: 0.01, 10: 0.9144, 14: 0.1, 15: 10.0, 22: 0.0254}
LINES = (offices.outlines, offices.two_faces, offices.four_lines, offices.hatches)
SYMBOLS = (dxf.shut, dxf.two_leaves)
IN_BLOCKS: list[dict[str, Any]] = [{}, {"scale": 0.001}, {"mirror": True}]
DRAWN = [
    *moved("dxf", dxf.files, THICK, (*MOVES, *FAR)),
    *(cell for code, metre in INSUNITS.items() for cell in cells("dxf", "units", drawn(units=code, unit=metre), right=THICK)),
    *cells("dxf", "units", drawn(units=0), asks="does not say its units"),
    *(Cell("dxf", "thick walls", drawn(thick=t, walls=lines), right=Right(t)) for t in (0.3, 0.365, 0.6) for lines in LINES),
    *(Cell("dxf", "thick walls", drawn(thick=thick), move, right=Right(thick)) for thick in (0.3, 0.6) for move in (MOVES[2], FAR[1])),
    *(cell for door in SYMBOLS for cell in moved("dxf", drawn(door=door), THICK, FAR[1:])),
    *(Cell("dxf", "shut leaves", drawn(door=dxf.shut, change=dxf.drawn_through), move, "a wall is drawn through", THICK) for move in (STAY, FAR[1])),
    *cells("dxf", "hidden", *(drawn(change=partial(dxf.hidden, state=state)) for state in ("freeze", "off", "invisible")), right=THICK),
    *cells("dxf", "hidden", drawn(change=dxf.on_paper), asks="copy it to the model space"),
    *(Cell("dxf", "hidden", drawn(change=partial(dxf.blocked, clip=True)), move, right=THICK) for move in (STAY, *FAR)),
    *cells("dxf", "packed", drawn(fmt="bin"), *(drawn(change=partial(dxf.blocked, **about)) for about in IN_BLOCKS), right=THICK),
    *cells("dxf", "own layers", drawn(change=dxf.exits), drawn(layers=("walls", "doors")), drawn(layers=("A-WALL", "A-WALL")), right=THICK),
    *cells("dxf", "own layers", *(drawn(layers=pair) for pair in (("AR_Innenwände", "AR_Türen"), ("墙体", "门窗"))), right=THICK),
    *cells("dxf", "copied storeys", dxf.files, asks="names the storeys are EG, 1. OG, 2. OG from the lowest", level_names=("1. OG", "2. OG", "EG")),
    *cells("dxf", "own layers", drawn(layers=("0", "0")), asks="--layer walls=0"),
    *cells("dxf", "own layers", drawn(change=dxf.on_paper_beside_a_point), asks="copy it to the model space"),
    *(Cell("dxf", "beside the house", drawn(change=partial(dxf.sheet, parts=parts)), move, r"--window -?[0-9.,-]+", THICK)
      for parts in ("frame", "frame title", "title", "arrow", "frame title arrow") for move in (STAY, FAR[0])),
    *cells("dxf", "beside the house", drawn(change=dxf.titles), asks="3 names lie beside the walls"),
    *cells("dxf", "spellings", *(drawn(names=layer) for layer in ("0", "TEXT", "A-ANNO-NOTE")), right=THICK),
]  # fmt: skip


MODELS = [
    *moved("ifc", model.write, SOLID, (MOVES[1], MOVES[4])),
    *moved("ifc", model.write, THICK, FAR),
    *cells("ifc", "units", *(partial(model.write, units=name) for name in ("FEET", "INCHES", "METERS")), right=SOLID),
    *cells("ifc", "spellings", partial(model.write, schema="IFC2X3"), partial(model.write, z=312.4), right=SOLID),
    *cells("ifc", "far", partial(model.write, change=model.storeys_anywhere), right=SOLID),
    *cells("ifc", "datum", partial(model.write, change=lambda made: georeference.add_georeferencing(made.file)), asks="map conversion"),
    *cells("ifc", "contradictions", partial(model.write, change=model.storeys_at_0), asks="^note: .*6.00 m.: Elevation is taken", right=SOLID),
    *cells("ifc", "contradictions", partial(model.write, change=model.elevations_0), asks="^note: .*0.00 m.: placement is taken", right=SOLID),
    *cells("ifc", "contradictions", partial(model.write, change=model.spaces_below), asks="4 rooms .* lie at another height than the storey"),
    *cells("ifc", "contradictions", partial(model.write, change=model.wide_doors), asks="OverallWidth and opening of 4 doors differ"),
    *cells("ifc", "solid walls", partial(model.write, voids=False), right=SOLID),
    *cells("ifc", "solid walls", partial(model.write, voids=False, thick=0.4), right=Right(0.4)),
    *cells("ifc", "thick walls", partial(model.write, thick=0.6), right=Right(0.6)),
]  # fmt: skip


def outcome(cell: Cell, folder: Path) -> str:
    """What differs from the house, or what is asked."""
    report, path = ImportReport(), cell.write(folder, cell.move)
    first, *above = [path] if isinstance(path, Path) else path
    try:
        plan = load_plan(first) if first.name == "plan.json" else import_plan(first, Hints(**cell.hints), above, report)
    except EchostepError as error:
        return f"refused: {error}"
    notes = [line for line in summary(plan, report) if line.startswith("note: ")]
    return "; ".join([*cell.right.differences(plan, cell.move), *(notes if cell.asks else [])])


def named(cell: Cell) -> str:
    return f"{cell.importer}-{cell.habit}"


@pytest.mark.parametrize("cell", [*OSM, *IMDF, *RASTERS, *DRAWN, *MODELS], ids=named)
def test_a_cell_is_right_or_asks(tmp_path: Path, cell: Cell) -> None:
    said = outcome(cell, tmp_path)
    assert re.search(cell.asks, said) if cell.asks else not said, said
