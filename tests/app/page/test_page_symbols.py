# SPDX-License-Identifier: MIT
"""Stairs, lifts, doors and windows are drawn as such on both pages, in Chromium; the legend names each sign."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from echostep.plan import Connector, Plan
from page.browser import loaded_page, violations, wait_for
from page.roles import role_page
from plan.imported_plans import seven_floors

SIZES = {"desk": (1280, 800), "phone": (360, 740), "sideways": (740, 360)}
DRAWN = "[...document.querySelectorAll('#walls path')].map((e) => e.classList[0])"
WAYS = "[...document.querySelectorAll('#rooms .way')].filter((e) => e.getAttribute('visibility') === 'visible').map((e) => e.textContent)"
# In the near view; the window is out of it in a low window
KINDS = {"wall", "door", "unknown", "stairs", "lift", "ramp"}


def building() -> Plan:
    """The seven floors, where one of a floor's doors is shut, one open, and a ramp leads from the basement to the ground floor."""
    plan = seven_floors()
    ramp = Connector("ramp", "", (0, 1), np.array([(8.5, 6.2), (14.5, 6.2), (14.5, 7.2), (8.5, 7.2)]))
    levels = []
    for level in plan.levels:
        shut, open_, *unknown = level.doors
        doors = (replace(shut, state="closed"), replace(open_, state="open"), *unknown)
        levels.append(replace(level, doors=doors))
    return replace(plan, levels=tuple(levels), connectors=(*plan.connectors, ramp))


def looked_at(page: Any) -> None:
    """What both pages share: every kind of line and the ways' names are drawn, and the legend opens, fits and closes."""
    wait_for(page, "echostep.scene.level === 1 && document.querySelector('#walls .stairs')")
    page.click("#whole")
    wait_for(page, f"['wall', 'window', 'stairs', 'lift'].every((kind) => {DRAWN}.includes(kind))")
    page.evaluate("(() => { echostep.view.centre(16, 9); echostep.view.scale = 30; echostep.view.changed(); })()")
    wait_for(page, f"{sorted(KINDS)}.every((kind) => {DRAWN}.includes(kind))")
    wait_for(page, f"{WAYS}.includes('Stairs A ↑↓') && {WAYS}.includes('ramp ↓')")
    page.focus("#map")
    page.keyboard.press("l")
    wait_for(page, "document.querySelector('#legend').open")
    wide, tall = page.viewport_size["width"], page.viewport_size["height"]
    box = page.locator("#legend").bounding_box()
    assert box["x"] >= 0
    assert box["y"] >= 0
    assert box["x"] + box["width"] <= wide
    assert box["y"] + box["height"] <= tall
    words = page.inner_text("#legend")
    assert all(word in words for word in ("wall", "window", "door that is open", "shut", "stairs", "lift", "ramp"))
    assert violations(page) == []
    page.keyboard.press("Escape")
    wait_for(page, "!document.querySelector('#legend').open")
    page.click("#legend-button")
    page.click("#legend [aria-label=Close]")
    wait_for(page, "!document.querySelector('#legend').open")
    assert not page.wrong


@pytest.mark.parametrize(("role", "size"), [("wearer", "phone"), ("wearer", "sideways"), ("commander", "desk")])
def test_stairs_lifts_doors_and_windows_are_seen(browser: Any, role: str, size: str) -> None:
    plan, (width, height) = building(), SIZES[size]
    with role_page(role, plan, (4.0, 7.0), 1) as (url, ready):
        page = loaded_page(browser, url, {"viewport": {"width": width, "height": height}}, ready)
        looked_at(page)
