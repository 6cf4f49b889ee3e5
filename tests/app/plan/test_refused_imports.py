# SPDX-License-Identifier: MIT
"""Files that are no plan, damaged ones and hostile ones: each import ends with one sentence that names what is wrong (tests/snapshots)."""

from __future__ import annotations

import json
import re
import zipfile
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from echostep_app.commands.options import layers_of, unit_of, windows_of
from echostep_app.plan.importers.formats import NEXT_STEPS, PICTURES, import_plan, is_foreign
from echostep_app.plan.importers.imdf import archive
from echostep_app.plan.importers.parsing import FORMATS
from echostep_app.plan.importers.report import Hints
from plan import test_plan_importer_imdf as imdf
from plan import test_plan_importer_osm as osm
from plan.test_plan_importer_rasters import grid
from snapshots import expect, refusal


def osm_json(*elements: Any) -> str:
    return json.dumps({"elements": elements})


def feature(kind: str, at: Any, **tags: str) -> str:
    return osm.geojson((kind, at, tags))


def image(colour: int, kind: str = "png") -> bytes:
    made = BytesIO()
    Image.new("L", (60, 60), colour).save(made, kind)
    return made.getvalue()


ROOM = {"indoor": "room", "level": "0", "name": "Room 1"}
OUTDOORS = [[[0, 0], [1, 0], [0, 0]]]
EMPTY_IFC = (
    "ISO-10303-21;HEADER;FILE_DESCRIPTION((''),'2;1');FILE_NAME('','',(''),(''),'','','');FILE_SCHEMA(('IFC4'));"
    "ENDSEC;DATA;ENDSEC;END-ISO-10303-21;"
)
FILES: dict[str, dict[str, str | bytes]] = {
    "json": {
        "elements are no list": '{"elements": 3}',
        "nothing indoors": osm_json(),
        "no number": osm_json({"type": "node", "id": "a"}),
        "no longitude": osm_json({"type": "node", "id": 7, "lon": 200, "lat": 0}),
        "not a number": '{"elements": [{"type": "node", "id": 7, "lon": NaN, "lat": 0}]}',
        "a way of truths": osm_json({"type": "way", "id": 7, "nodes": [True]}),
        "nodes that are not there": osm_json(osm.way(7, [1, 2], indoor="room", level="0")),
        "a node far away": osm_json(*osm.HOUSE, osm.node(50, 4e6, 0)),
        "a million levels": osm_json(*osm.HOUSE, osm.way(51, [1, 5], indoor="wall", level="0-9999999")),
    },
    "osm": {
        "empty": "",
        "cut": "<osm>",
        "a page": "<html/>",
        "a document type": '<!DOCTYPE x [<!ENTITY a "aaaa">]><osm>&a;</osm>',
        "no number": '<osm><node id="x" lon="1" lat="1"/></osm>',
        "not a number": '<osm><node id="1" lon="nan" lat="1"/></osm>',
        "no latitude": '<osm><node id="1" lon="1"/></osm>',
        "deep": "<osm>" + "<a>" * 100_000,
    },
    "xml": {
        "IndoorGML": '<c:X xmlns:c="http://www.opengis.net/indoorgml/1.0/core"/>',
        "another": '<c:X xmlns:c="urn:other"/>',
    },
    "geojson": {
        "nothing indoors": feature("Polygon", OUTDOORS, building="yes"),
        "a curve": feature("Curve", [], **ROOM),
        "no longitude": feature("Point", [200, 0], **ROOM),
        "one coordinate": feature("Point", [1], **ROOM),
        "no coordinates": feature("Polygon", 3, **ROOM),
    },
    "ifc": {"empty": "", "words": "hello", "damaged": "ISO-10303-21;\nHEADER;\nnonsense", "without storeys": EMPTY_IFC},
    "dxf": {
        "empty": b"",
        "words": b"hello",
        "zeros": bytes(1000),
        "cut": b"0\nSECTION\n2\nENTITIES\n0\nLINE\n",
        "damaged": b"AutoCAD Binary DXF\r\n\x1a\x00" + b"\xff" * 99,
    },
    "yaml": {
        "empty": "",
        "another": "a: 1",
        "no picture there": "image: none.pgm\nresolution: 0.05",
        "no resolution": "image: map.pgm",
        "no metres": "image: map.pgm\nresolution: 0",
        "not a number": "image: map.pgm\nresolution: nan",
        "a short origin": "image: map.pgm\nresolution: 0.05\norigin: [1]",
        "an origin of letters": "image: map.pgm\nresolution: 0.05\norigin: [1, x, 0]",
        "an origin far away": "image: map.pgm\nresolution: 0.05\norigin: [1, 1e9, 0]",
        "itself as the picture": "image: a.yaml\nresolution: 0.05",
        "nothing occupied": "image: map.pgm\nresolution: 0.05\nnegate: 1\noccupied_thresh: 1",
    },
    "png": {"white": image(255), "black": image(0), "words": b"no picture"},
    "ifczip": {"no zip": b"PK\x03\x04x"},
    "zip": {"no zip": b"PK\x03\x04 nothing"},
}  # fmt: skip
FOREIGN = r"(not JSON|not XML|not an IFC file|not a DXF drawing|not a zip file|cannot be read|that can be read): .*"  # what a library says behind it


def of_import(path: Path, hints: Hints | None = None) -> str:
    """The sentence, without a library's words behind it."""
    return re.sub(FOREIGN, r"\1", refusal(lambda: import_plan(path, hints or Hints())))


@pytest.mark.parametrize("kind", FILES)
def test_files_of_a_format(tmp_path: Path, kind: str) -> None:
    Image.fromarray(grid()).save(tmp_path / "map.pgm")
    said = {}
    for case, content in FILES[kind].items():
        path = tmp_path / f"a.{kind}"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        said[f"{kind}: {case}"] = of_import(path, Hints(scale_m=0.02 if kind == "png" else None))
    expect("plan import refused", said, FOLDER=tmp_path, FORMATS=FORMATS)


def changed(name: str, place: int, **about: Any) -> dict[str, Any]:
    """The archive of a mall with a feature altered."""
    tree = imdf.files()
    tree[name]["features"][place] |= about
    return tree


ARCHIVES: dict[str, Mapping[str, Any]] = {
    "one file": {"unit.geojson": "{}"},
    "a manifest": {"manifest.json": "{}"},
    "damaged": imdf.files() | {"unit.geojson": "[1"},
    "deep": imdf.files() | {"unit.geojson": "[" * 100_000},
    "no levels": imdf.files() | {"level.geojson": {"type": "FeatureCollection", "features": []}},
    "a category of numbers": changed("unit.geojson", 1, properties={"category": 4, "level_id": "L0"}),
    "a point as an area": changed("unit.geojson", 1, geometry={"type": "Polygon", "coordinates": [[[0, 0]]]}),
    "a storey of letters": changed("level.geojson", 1, properties={"ordinal": "x"}),
    "no geometry": changed("level.geojson", 0, geometry={"coordinates": []}),
    "a level file of blanks": imdf.files() | {"level.geojson": " " * 2_000_000},
}


def test_archives(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(archive, "LARGEST_BYTES", 1_000_000)
    said = {}
    for case, tree in ARCHIVES.items():
        path = imdf.zipped(tmp_path / "a.zip", dict(tree))
        said[f"archive: {case}"] = of_import(path)
    damaged = bytearray(imdf.zipped(tmp_path / "a.zip", imdf.files()).read_bytes())
    damaged[200:400] = bytes(200)
    (tmp_path / "a.zip").write_bytes(damaged)
    said["archive: zeros in it"] = of_import(tmp_path / "a.zip")
    with zipfile.ZipFile(tmp_path / "a.ifczip", "w") as packed:
        packed.writestr("readme.txt", "x")
    said["archive: no model"] = of_import(tmp_path / "a.ifczip")
    said["archive: none"] = of_import(tmp_path / "none.zip")
    options = {
        "doors": Hints(doors_m=0.9), "units": Hints(units="mm"), "window": Hints(windows=[(0, 0, 1, 1)]), "align": Hints(align=True),
        "scale": Hints(scale_m=1.0), "level": Hints(level_names=["a"]), "layer": Hints(layers={"walls": ["a"]}),
    }  # fmt: skip
    said |= {
        f"another format's option {name}": of_import(tmp_path / "plan.osm", hints) for name, hints in options.items()
    }
    said["a PDF with a scale"] = of_import(tmp_path / "a.pdf", Hints(scale_m=1.0))
    said["a window of no size"] = refusal(lambda: windows_of(["1,1,0,2"]))
    said["a layer of no kind"] = refusal(lambda: layers_of(["roofs=A"]))
    said["a layer without a pattern"] = refusal(lambda: layers_of(["walls"]))
    said["no unit"] = refusal(lambda: unit_of("li"))
    said["two models"] = refusal(lambda: import_plan(tmp_path / "a.ifc", Hints(), [tmp_path / "b.ifc"]))
    expect("plan import refused", said, FOLDER=tmp_path)


def test_formats_that_are_not_read_and_pictures_without_a_scale_name_the_next_step(tmp_path: Path) -> None:
    said = {}
    for suffix in sorted(NEXT_STEPS):
        path = tmp_path / f"plan{suffix.upper()}"
        path.write_bytes(b"x")
        said[f"format {suffix}"] = of_import(path)
        assert is_foreign(path)
    for suffix in PICTURES:
        path = tmp_path / f"a{suffix}"
        Image.fromarray(np.zeros((40, 40), dtype=bool)).save(path)
        for case, hints in {"without a scale": Hints(), "with units": Hints(units="m", scale_m=1.0)}.items():
            sentence = of_import(path, hints).replace(suffix, ".png")
            assert said.setdefault(f"a picture {case}", sentence) == sentence
    expect("plan import refused", said, FOLDER=tmp_path)
