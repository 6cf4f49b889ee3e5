# SPDX-License-Identifier: MIT
"""Importing building models: two storeys with walls, a door, a window, a room and stairs, and what is no model."""

from __future__ import annotations

import math
import zipfile
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from pyproj import Transformer

from echostep.plan import Plan
from echostep_app.plan.importers.formats import import_plan
from echostep_app.plan.importers.report import ImportReport
from plan.imported_plans import imported_file

Schema = Literal["IFC2X3", "IFC4", "IFC4X3"]
Triple = tuple[float, float, float]
ifcopenshell = pytest.importorskip("ifcopenshell", reason="ifcopenshell is not installed: pip install 'echostep[ifc]'")


class Model:
    """A building in millimetres."""

    def __init__(self, schema: Schema = "IFC4") -> None:
        from ifcopenshell.api import aggregate, context, owner, project, root, unit

        self.file: Any = project.create_file(version=schema)
        if schema == "IFC2X3":  # needs an owner of each element
            person, company = owner.add_person(self.file), owner.add_organisation(self.file)
            owner.add_person_and_organisation(self.file, person=person, organisation=company)
            owner.add_application(self.file)
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

    def box(self, kind: str, at: Triple, size: Triple, turn: float = 0.0, name: str = "") -> Any:
        """An element of length, thickness and height in metres; its corner is at `at`."""
        from ifcopenshell.api import geometry, root

        element = root.create_entity(self.file, ifc_class=kind, name=name)
        shape = geometry.add_wall_representation(
            self.file, context=self.body, length=size[0], thickness=size[1], height=size[2]
        )
        geometry.assign_representation(self.file, product=element, representation=shape)
        self._put(element, *at, turn)
        return element

    def cut(self, wall: Any, at: Triple, size: Triple) -> Any:
        opening = self.box("IfcOpeningElement", at, size)
        self.add(wall, opening)
        return opening

    def add(self, wall: Any, opening: Any) -> None:
        from ifcopenshell.api import feature

        feature.add_feature(self.file, feature=opening, element=wall)

    def fill(self, opening: Any, element: Any) -> None:
        from ifcopenshell.api import feature

        feature.add_filling(self.file, opening=opening, element=element)

    def contain(self, storey: Any, *elements: Any) -> None:
        from ifcopenshell.api import spatial

        spatial.assign_container(self.file, products=list(elements), relating_structure=storey)

    def _put(self, product: Any, x: float, y: float, z: float, turn: float) -> None:
        from ifcopenshell.api import geometry

        c, s = math.cos(turn), math.sin(turn)
        matrix = np.array([[c, -s, 0, x], [s, c, 0, y], [0, 0, 1, z], [0, 0, 0, 1]])
        geometry.edit_object_placement(self.file, product=product, matrix=matrix)


def write_house(folder: Path) -> Path:
    """6 m by 4 m, walls of 0.3 m, on two floors 3 m apart; a door in the south, a window in the north of the ground floor."""
    model = Model()
    model.site.RefLatitude, model.site.RefLongitude = (53, 6, 36), (8, 51, 0)
    for i, z in enumerate((0.0, 3.0)):
        model.storey(f"Floor {i}", z)
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
    ground, upper = (level.walls for level in house.levels)
    assert len(upper) == 8
    assert np.hypot(*(upper[:, 2:] - upper[:, :2]).T).sum() == pytest.approx(2 * (6 + 4) + 2 * (5.4 + 3.4), abs=0.02)
    assert (upper.min(), upper.max()) == (0.0, 6.0)
    x, y = ground[:, ::2], ground[:, 1::2]
    inside_door = (y.max(axis=1) < 0.31) & (x.min(axis=1) > 1.99) & (x.max(axis=1) < 3.01)
    assert all(x0 == x1 for x0, _, x1, _ in ground[inside_door])  # only its jambs
    assert [len(level.windows) >= 2 for level in house.levels] == [True, False]


PLACE, TURN = (489_000.0, 5_884_000.0), math.radians(30.0)  # in UTM zone 32: a degree of longitude west of its middle


def mapped(schema: Schema, name: str, unit_m: float = 1.0, at: tuple[float, float] = (0.0, 0.0)) -> Model:
    """A wall at a place of the model, whose origin is `PLACE` on the map."""
    from ifcopenshell.api import georeference, pset

    model = Model(schema)
    model.contain(model.storey("Ground", 0.0), model.box("IfcWall", (*at, 0), (6, 0.3, 2.8)))
    stated = {
        "Eastings": PLACE[0] / unit_m, "Northings": PLACE[1] / unit_m, "OrthogonalHeight": 0.0,
        "XAxisAbscissa": math.cos(TURN), "XAxisOrdinate": math.sin(TURN), "Scale": 0.001 / unit_m,
    }  # fmt: skip
    if schema == "IFC4":
        georeference.add_georeferencing(model.file)
        georeference.edit_georeferencing(model.file, coordinate_operation=stated, projected_crs={"Name": name})
        return model
    for title, values in (("ePSet_MapConversion", stated), ("ePSet_ProjectedCRS", {"Name": name})):
        pset.edit_pset(model.file, pset=pset.add_pset(model.file, product=model.site, name=title), properties=values)
    return model


@pytest.mark.parametrize("schema", ["IFC2X3", "IFC4"])
@pytest.mark.parametrize("unit_m", [1.0, 0.001])
@pytest.mark.parametrize("at", [(0.0, 0.0), (30_000.0, 0.0)])
def test_its_place_on_a_map(tmp_path: Path, schema: Schema, unit_m: float, at: tuple[float, float]) -> None:
    """Eastings in metres or in the model's millimetres, without a stated unit; grid north is not north."""
    plan, report = imported(mapped(schema, "EPSG:25832", unit_m, at), tmp_path)
    assert plan.georeference is not None
    c, s = math.cos(TURN), math.sin(TURN)
    lon, lat = Transformer.from_crs("EPSG:25832", "EPSG:4326", always_xy=True).transform(
        PLACE[0] + c * at[0], PLACE[1] + s * at[0]
    )
    assert (plan.georeference.longitude_deg, plan.georeference.latitude_deg) == pytest.approx((lon, lat), abs=1e-5)
    convergence = math.radians((lon - 9.0) * math.sin(math.radians(lat)))
    assert plan.georeference.rotation_rad == pytest.approx(TURN - convergence, abs=1e-4)
    assert not any("map conversion" in doubt for doubt in report.doubts)


@pytest.mark.parametrize("name", ["our own grid", "EPSG:27700", "EPSG:4326", ""])
def test_a_map_that_cannot_be_is_asked_about(tmp_path: Path, name: str) -> None:
    plan, report = imported(mapped("IFC4", name), tmp_path)
    assert plan.georeference is None
    assert any("its map conversion" in doubt and "georeference by hand" in doubt for doubt in report.doubts)


def imported(model: Model, folder: Path) -> tuple[Plan, ImportReport]:
    model.file.write(str(folder / "a.ifc"))
    return imported_file(folder / "a.ifc")


def walled(length_m: float = 8.0) -> tuple[Model, Any]:
    """A storey with a wall."""
    model = Model()
    model.storey("Ground", 0.0)
    return model, model.box("IfcWall", (0, 0, 0), (length_m, 0.2, 2.6))


def without_shape(model: Model, kind: str, **about: Any) -> Any:
    """An element without a representation."""
    from ifcopenshell.api import root

    element = root.create_entity(model.file, ifc_class=kind, name=kind)
    for name, value in about.items():
        setattr(element, name, value)
    return element


@pytest.mark.parametrize("schema", ["IFC2X3", "IFC4", "IFC4X3"])
@pytest.mark.parametrize("leaf", ["drawn open", "without a shape", "closed"])
def test_a_door_lies_in_its_opening(tmp_path: Path, leaf: str, schema: Schema) -> None:
    """The wall x 4.0 to 4.2 has an opening y 3 to 5, which reaches out of the wall on one side."""
    model = Model(schema)
    model.storey("Ground", 0.0)
    wall = model.box("IfcWall", (4.2, 0, 0), (8, 0.2, 2.6), math.pi / 2)
    opening = model.cut(wall, (4.0, 3.0, 0), (0.5, 2.0, 2.1))
    sizes: dict[str, Triple] = {"drawn open": (1.0, 0.05, 2.1), "closed": (0.05, 2.0, 2.1)}
    door = model.box("IfcDoor", (4.05, 3.0, 0), sizes[leaf]) if leaf in sizes else without_shape(model, "IfcDoor")
    model.fill(opening, door)
    plan, report = imported(model, tmp_path)
    assert len(plan.levels[0].doors) == 1
    x0, y0, x1, y1 = plan.levels[0].doors[0].line
    assert (x0, x1) == pytest.approx((4.1, 4.1), abs=0.01)
    assert sorted((y0, y1)) == pytest.approx([3, 5], abs=0.01)
    assert report.left_out == {}


def test_a_door_without_opening_has_its_placement(tmp_path: Path) -> None:
    """A leaf drawn open, 0.9 m wide along the placement's x."""
    model, _ = walled(4.0)
    model.box("IfcWall", (4.9, 0, 0), (4, 0.2, 2.6))
    door = model.box("IfcDoor", (4.0, 0.1, 0), (0.9, 0.9, 2.1))
    door.OverallWidth, door.OverallHeight = 900.0, 2100.0
    plan, _ = imported(model, tmp_path)
    assert [one.line for one in plan.levels[0].doors] == [pytest.approx((4.0, 0.1, 4.9, 0.1), abs=0.01)]


def test_what_has_no_shape_is_counted_and_filled_openings_place_windows(tmp_path: Path) -> None:
    model, wall = walled()
    model.fill(model.cut(wall, (2, -0.1, 0.8), (1.5, 0.4, 1.2)), without_shape(model, "IfcWindow"))
    for kind in ("IfcDoor", "IfcWindow", "IfcWall"):
        without_shape(model, kind)
    for kind in ("IfcSlab", "IfcFurniture", "IfcFurniture"):
        model.box(kind, (0, 0, 0), (1, 1, 0.2))
    plan, report = imported(model, tmp_path)
    assert len(plan.levels[0].windows) >= 2
    assert report.left_out == {
        "IfcWall without a shape": 1, "IfcWindow without a shape": 1, "IfcDoor without a shape, an opening or a width": 1,
        "IfcSlab": 1, "IfcFurniture": 2,
    }  # fmt: skip
    assert "doors without a shape were left out" in report.doubts[0]


def test_reference_levels_are_no_storeys(tmp_path: Path) -> None:
    """Levels without walls, doors and rooms close to another one; two half storeys with walls stay, and are told."""
    model = Model()
    heights = {"Slab 0": -0.36, "Ground": 0.0, "Slab 1": 2.6, "First": 2.9, "Half": 4.2}
    named = {name: model.storey(name, z) for name, z in heights.items()}
    for name in ("Ground", "First", "Half"):
        model.contain(named[name], model.box("IfcWall", (0, 0, heights[name]), (8, 0.2, 2.0)))
    plan, report = imported(model, tmp_path)
    assert [level.name for level in plan.levels] == ["Ground", "First", "Half"]
    assert report.doubts == [
        "reference levels, not storeys: Slab 0 (-0.36 m), Slab 1 (2.6 m)",
        "levels First and Half are 1.30 m apart: half storeys, or reference levels?",
    ]


def test_names_of_storeys_and_rooms(tmp_path: Path) -> None:
    """Of a storey the name goes before the long name, of a room the other way round."""
    model, _ = walled()
    model.file.by_type("IfcBuildingStorey")[0].LongName = "ACID00000001"
    model.box("IfcSpace", (1, 1, 0), (2, 2, 2.6), name="1.01").LongName = "Kitchen"
    plan, _ = imported(model, tmp_path)
    assert plan.levels[0].name == "Ground"
    assert [room.name for room in plan.levels[0].rooms] == ["Kitchen"]


def test_a_packed_model(tmp_path: Path) -> None:
    house = write_house(tmp_path)
    with zipfile.ZipFile(tmp_path / "house.ifczip", "w", zipfile.ZIP_DEFLATED) as packed:
        packed.write(house, "model/house.ifc")
    assert import_plan(tmp_path / "house.ifczip").digest == import_plan(house).digest


def concrete_kinds(kind: str) -> list[str]:
    """The classes of IFC4 below one that a model can have."""

    def below(declaration: Any) -> list[Any]:
        return [declaration, *(inner for one in declaration.subtypes() for inner in below(one))]

    schema = ifcopenshell.ifcopenshell_wrapper.schema_by_name("IFC4")
    return [one.name() for one in below(schema.declaration_by_name(kind)) if not one.is_abstract()]


@pytest.mark.slow
def test_every_class_of_elements_is_used_or_counted(tmp_path: Path) -> None:
    """One element of each class of IFC4, all far above the storeys; those that are no bodies of a building, as openings, are not counted."""
    model, _ = walled()
    parents = ("IfcFeatureElement", "IfcPort", "IfcVirtualElement", "IfcElementComponent")
    silent = {kind for parent in parents for kind in concrete_kinds(parent)}
    kinds = sorted({*concrete_kinds("IfcElement"), "IfcSpace"} - silent)
    for kind in kinds:
        model.box(kind, (0, 0, 50.0), (2, 0.2, 2.0))
    plan, report = imported(model, tmp_path)
    assert len(kinds) > 100
    assert len(plan.levels[0].walls) == 4
    assert {what.split()[0] for what in report.left_out} == set(kinds)
    assert sum(report.left_out.values()) == len(kinds)


def test_what_lies_on_one_level_alone_is_counted(tmp_path: Path) -> None:
    model = Model()
    for k in range(2):
        model.storey(f"Floor {k}", 3.0 * k)
        model.box("IfcWall", (0, 0, 3.0 * k), (8, 0.2, 2.6))
    model.box("IfcStairFlight", (1, 1, 0), (1, 2, 1.0))
    model.box("IfcTransportElement", (4, 1, 0), (1, 1, 6.0)).PredefinedType = "ESCALATOR"
    model.box("IfcTransportElement", (6, 1, 0), (1, 1, 6.0)).PredefinedType = "ELEVATOR"
    plan, report = imported(model, tmp_path)
    assert [connector.kind for connector in plan.connectors] == ["lift"]
    assert report.left_out == {"stairs on one level only": 1, "IfcTransportElement that is no lift": 1}


@pytest.mark.parametrize("parts", [(-33, 51, 30), (-33, -51, 30), (-33, 51, 30, 0), (-33, 50, 89, 1000000)])
def test_an_angle_has_the_sign_of_its_first_part(tmp_path: Path, parts: tuple[int, ...]) -> None:
    model, _ = walled()
    model.site.RefLatitude, model.site.RefLongitude = parts, (0, -6, 36)
    place = imported(model, tmp_path)[0].georeference
    assert place is not None
    assert (place.latitude_deg, place.longitude_deg) == pytest.approx((-33.858333, -0.11))


@pytest.mark.parametrize(
    ("field", "value"), [("PredefinedType", "GFA"), ("PredefinedType", "EXTERNAL"), ("ObjectType", "GFA")]
)
def test_gross_areas_and_outdoor_spaces_are_no_rooms(tmp_path: Path, field: str, value: str) -> None:
    model, _ = walled()
    setattr(model.box("IfcSpace", (0, 0, 0), (8, 6, 2.6)), field, value)
    plan, report = imported(model, tmp_path)
    assert (plan.levels[0].rooms, report.left_out) == ((), {"IfcSpace that is no room": 1})


@pytest.mark.parametrize("on", ["IfcWall", "IfcDoor"])
@pytest.mark.parametrize("status", ["DEMOLISH", "EXISTING", "TEMPORARY"])
def test_what_is_demolished_is_left_out(tmp_path: Path, on: str, status: str) -> None:
    from ifcopenshell.api import pset

    model, _ = walled()
    wall = model.box("IfcWall", (0, 4, 0), (8, 0.2, 2.6))
    door = model.box("IfcDoor", (2, 4, 0), (1, 0.2, 2.1))
    model.fill(model.cut(wall, (2, 3.9, 0), (1, 0.4, 2.1)), door)
    about = pset.add_pset(model.file, product={"IfcWall": wall, "IfcDoor": door}[on], name=f"Pset_{on[3:]}Common")
    pset.edit_pset(model.file, pset=about, properties={"Status": status})
    plan, report = imported(model, tmp_path)
    gone = {"IfcDoor", on} if status == "DEMOLISH" else set()
    assert report.left_out == {f"{kind} to be demolished": 1 for kind in gone}
    assert (len(plan.levels[0].walls), len(plan.levels[0].doors)) == (12 - 8 * ("IfcWall" in gone), 1 - bool(gone))
