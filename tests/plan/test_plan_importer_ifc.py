# SPDX-License-Identifier: MIT
"""Importing building models: two storeys with walls, a door, a window, a room and stairs, and what is no model."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from echostep.errors import EchostepError
from echostep.plan.importers.formats import import_plan
from echostep.plan.model import Plan

ifcopenshell = pytest.importorskip("ifcopenshell", reason="ifcopenshell is not installed: pip install 'echostep[ifc]'")


class Model:
    """A building in millimetres."""

    def __init__(self) -> None:
        from ifcopenshell.api import aggregate, context, project, root, unit

        self.file: Any = project.create_file()
        self.project = root.create_entity(self.file, ifc_class="IfcProject", name="House")
        unit.assign_unit(self.file)  # millimetres
        model = context.add_context(self.file, context_type="Model")
        self.body = context.add_context(
            self.file, context_type="Model", context_identifier="Body", target_view="MODEL_VIEW", parent=model
        )
        self.site = root.create_entity(self.file, ifc_class="IfcSite", name="Site")
        self.laid_out = root.create_entity(self.file, ifc_class="IfcBuilding", name="Building")
        aggregate.assign_object(self.file, products=[self.site], relating_object=self.project)
        aggregate.assign_object(self.file, products=[self.laid_out], relating_object=self.site)

    def storey(self, name: str, z_m: float) -> Any:
        from ifcopenshell.api import aggregate, root

        storey = root.create_entity(self.file, ifc_class="IfcBuildingStorey", name=name)
        aggregate.assign_object(self.file, products=[storey], relating_object=self.laid_out)
        self._put(storey, 0, 0, z_m, 0)
        return storey

    def box(
        self,
        kind: str,
        at: tuple[float, float, float],
        size: tuple[float, float, float],
        turn: float = 0.0,
        name: str = "",
    ) -> Any:
        """An element of length, thickness and height in metres; its corner is at `at`."""
        from ifcopenshell.api import geometry, root

        element = root.create_entity(self.file, ifc_class=kind, name=name)
        shape = geometry.add_wall_representation(
            self.file, context=self.body, length=size[0], thickness=size[1], height=size[2]
        )
        geometry.assign_representation(self.file, product=element, representation=shape)
        self._put(element, *at, turn)
        return element

    def cut(self, wall: Any, at: tuple[float, float, float], size: tuple[float, float, float]) -> None:
        from ifcopenshell.api import feature

        feature.add_feature(self.file, feature=self.box("IfcOpeningElement", at, size), element=wall)

    def _put(self, product: Any, x: float, y: float, z: float, turn: float) -> None:
        from ifcopenshell.api import geometry

        c, s = math.cos(turn), math.sin(turn)
        matrix = np.array([[c, -s, 0, x], [s, c, 0, y], [0, 0, 1, z], [0, 0, 0, 1]])
        geometry.edit_object_placement(self.file, product=product, matrix=matrix)


def write_house(folder: Path) -> Path:
    """6 m by 4 m, walls of 0.3 m, on two floors 3 m apart; a door in the south, a window in the north of the ground floor."""
    model = Model()
    model.site.RefLatitude, model.site.RefLongitude = (53, 6, 36), (8, 51, 0)
    for i in range(2):
        model.storey(f"Floor {i}", 3.0 * i)
        z = 3.0 * i
        south = model.box("IfcWall", (0, 0, z), (6, 0.3, 2.8))
        north = model.box("IfcWall", (0, 3.7, z), (6, 0.3, 2.8))
        model.box("IfcWall", (0.3, 0.3, z), (3.4, 0.3, 2.8), math.pi / 2)
        model.box("IfcWall", (6, 0.3, z), (3.4, 0.3, 2.8), math.pi / 2)
        if i == 0:
            model.cut(south, (2, -0.1, 0), (1, 0.5, 2.1))
            model.box("IfcDoor", (2, 0.1, 0), (1, 0.1, 2.1), name="Front door")
            model.cut(north, (2, 3.6, 0.8), (2, 0.5, 1.2))
            model.box("IfcWindow", (2, 3.8, 0.8), (2, 0.1, 1.2))
    model.box("IfcSpace", (0.3, 0.3, 0), (5.4, 3.4, 2.8), name="Hall")
    model.box("IfcStairFlight", (0.5, 0.5, 0), (1, 2.5, 3.0), name="Stairs")
    path = folder / "house.ifc"
    model.file.write(str(path))
    return path


@pytest.fixture(scope="module")
def house(tmp_path_factory: pytest.TempPathFactory) -> Plan:
    return import_plan(write_house(tmp_path_factory.mktemp("ifc")))


def test_storeys_and_their_walls(house: Plan) -> None:
    assert [(level.name, level.height_m) for level in house.levels] == [("Floor 0", 0.0), ("Floor 1", 3.0)]
    upper = house.levels[1].walls
    assert len(upper) == 8
    assert np.hypot(*(upper[:, 2:] - upper[:, :2]).T).sum() == pytest.approx(2 * (6 + 4) + 2 * (5.4 + 3.4), abs=0.02)
    ground = house.levels[0].walls
    assert (upper.min(), upper.max()) == (0.0, 6.0)
    inside_door = (
        (ground[:, [1, 3]].max(axis=1) < 0.31)
        & (ground[:, [0, 2]].min(axis=1) > 1.99)
        & (ground[:, [0, 2]].max(axis=1) < 3.01)
    )
    assert all(x0 == x1 for x0, _, x1, _ in ground[inside_door])  # only its jambs


def test_doors_windows_rooms_and_stairs(house: Plan) -> None:
    ground = house.levels[0]
    assert [door.name for door in ground.doors] == ["Front door"]
    x0, y0, x1, y1 = ground.doors[0].line
    assert sorted((x0, x1)) == pytest.approx([2, 3], abs=0.01)
    assert (y0, y1) == pytest.approx((0.15, 0.15), abs=0.01)
    assert len(ground.windows) >= 2
    assert not len(house.levels[1].windows)
    assert [room.name for room in ground.rooms] == ["Hall"]
    assert [(c.kind, c.name, c.levels) for c in house.connectors] == [("stairs", "Stairs", (0, 1))]


def test_its_place_on_earth(house: Plan) -> None:
    assert house.georeference is not None
    assert (house.georeference.longitude_deg, house.georeference.latitude_deg) == pytest.approx((8.85, 53.11))
    assert house.georeference.rotation_rad == 0.0


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("", "not an IFC file"),
        ("hello", "not an IFC file"),
        ("ISO-10303-21;\nHEADER;\nnonsense", "not an IFC file|storey"),
        (
            "ISO-10303-21;HEADER;FILE_DESCRIPTION((''),'2;1');FILE_NAME('','',(''),(''),'','','');FILE_SCHEMA(('IFC4'));ENDSEC;DATA;ENDSEC;END-ISO-10303-21;",
            "storey|Storey",
        ),
    ],
)
def test_no_model(tmp_path: Path, text: str, named: str) -> None:
    (tmp_path / "a.ifc").write_text(text)
    with pytest.raises(EchostepError, match=named) as caught:
        import_plan(tmp_path / "a.ifc")
    assert "\n" not in str(caught.value)
