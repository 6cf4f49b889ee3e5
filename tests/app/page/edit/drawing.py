# SPDX-License-Identifier: MIT
"""The plan editor in a browser: open it, click and drag in metres of the plan, save.

With ECHOSTEP_PICTURES=1 the pictures of the manual are made anew.
"""

from __future__ import annotations

from typing import Any

from echostep.plan import load_plan
from echostep_app.page.editor import EditServer
from page.browser import loaded_page, spot
from waiting import until

PHONES = {"upright": (360, 740), "sideways": (740, 360)}


def opened(browser: Any, server: EditServer, **context: Any) -> Any:
    how = {"viewport": {"width": 1200, "height": 760}} | context
    return loaded_page(browser, server.url, how, "Boolean(window.echostep)")


def on_phone(browser: Any, server: EditServer, held: str) -> Any:
    """The page on a phone that is held in one of the ways of PHONES."""
    width, height = PHONES[held]
    return opened(browser, server, viewport={"width": width, "height": height}, has_touch=True, is_mobile=True)


def tap(page: Any, x_m: float, y_m: float) -> None:
    page.touchscreen.tap(*spot(page, x_m, y_m))


def click(page: Any, x_m: float, y_m: float) -> None:
    page.mouse.click(*spot(page, x_m, y_m))


def saved(page: Any, server: EditServer) -> Any:
    page.click("#save")
    page.get_by_text("Saved new.json").wait_for()
    return load_plan(server.file.path).levels[0]


def answers(page: Any, text: str, proposed: str = "") -> None:
    """The next question of the page, which proposes a text, is answered so."""

    def answer(dialog: Any) -> None:
        assert dialog.default_value == proposed
        dialog.accept(text)

    page.once("dialog", answer)


def drag(page: Any, begin: tuple[float, float], end: tuple[float, float], button: str = "left") -> None:
    page.mouse.move(*spot(page, *begin))
    page.mouse.down(button=button)
    page.mouse.move(*spot(page, *end), steps=4)
    page.mouse.up(button=button)


def status(page: Any) -> str:
    """What the page says."""
    return str(page.text_content("#status"))


def says(page: Any, words: str) -> None:
    """The page comes to say this."""
    assert until(lambda: status(page) == words), f"{status(page)!r}, not {words!r}"
