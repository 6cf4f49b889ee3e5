# SPDX-License-Identifier: MIT
"""Plans of other programs on the page, in Chromium on a phone: each format once, every floor shown."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from echostep.plan import Plan
from echostep_app.page.mailbox import Mailbox
from echostep_app.plan.importers.formats import import_plan
from page.browser import NAMES, looking, wait_for
from page.frames import scene, served, told
from plan import test_plan_importer_dxf as dxf
from plan import test_plan_importer_imdf as imdf
from plan import test_plan_importer_osm as osm
from plan.imported_plans import seven_floors


def from_dxf(folder: Path) -> Plan:
    """Two floors of 9 m by 6 m, drawn in millimetres, with a window and a name."""
    doc, space = dxf.drawing(4)
    space.add_lwpolyline([(0, 0), (9000, 0), (9000, 6000), (0, 6000)], close=True, dxfattribs={"layer": "A-WALL"})
    space.add_line((3000, 0), (3000, 4000), {"layer": "A-WALL"})
    space.add_line((4000, 6000), (6000, 6000), {"layer": "A-GLAZ"})
    space.add_text("Hall", height=300, dxfattribs={"layer": "A-ROOM", "insert": (6000, 3000)})
    for name in ("ground.dxf", "upper.dxf"):
        doc.saveas(folder / name)
    return import_plan(folder / "ground.dxf", above=[folder / "upper.dxf"])


def from_ifc(folder: Path) -> Plan:
    """Two storeys of 6 m by 4 m, with a door, windows, a room and stairs."""
    pytest.importorskip("ifcopenshell", reason="ifcopenshell is not installed: pip install 'echostep[ifc]'")
    from plan.test_plan_importer_ifc import write_house

    return import_plan(write_house(folder))


FORMATS: dict[str, Callable[[Path], Plan]] = {
    "DXF": from_dxf,
    "IMDF": lambda folder: import_plan(imdf.folder(folder / "mall", imdf.files())),
    "OSM": lambda folder: osm.imported(folder, osm.HOUSE),
    "IFC": from_ifc,
    "edited": lambda _: seven_floors(),
}


@pytest.mark.parametrize("kind", FORMATS)
def test_every_floor_of_an_imported_plan_is_on_the_page(browser: Any, kind: str, tmp_path: Path) -> None:
    plan = FORMATS[kind](tmp_path)
    assert len(plan.levels) > 1
    x_m, y_m = plan.levels[1].solid.reshape(-1, 2).mean(axis=0).tolist()
    mailbox = Mailbox(plan, f"A plan from {kind}", replay=False)
    shares = tuple(float(k == 1) for k in range(len(plan.levels)))
    with served(mailbox) as (server, _):
        estimate = replace(told(x_m, y_m), level=1, levels=shares)
        mailbox.publish(
            replace(scene(), estimate=estimate, echo_lines=(), particles=None, status_text="tracking, 0.2 m")
        )
        page = looking(browser, server.url, "bright")
        wait_for(page, "echostep.scene.level === 1")
        wait_for(page, "document.querySelector('#walls path') !== null")
        assert plan.levels[1].name in page.text_content("#place")
        for k, level in enumerate(plan.levels):
            page.evaluate(f"document.querySelectorAll('#floors button')[{k}].click()")
            wait_for(page, f"echostep.scene.level === {k} && document.querySelector('#walls path') !== null")
            assert set(page.evaluate(NAMES)) <= {room.name for room in level.rooms}
            assert bool(page.evaluate(NAMES)) == bool(level.rooms)
        assert page.text_content("#fault") == ""
        assert not page.wrong
    assert not server.shared.faults.notices
