# SPDX-License-Identifier: MIT
"""Where a team is shown.

In: options of the command. Out: `Views`; the page, the roster as JSON. Owns nothing.
"""

from __future__ import annotations

import json
import sys
from contextlib import ExitStack
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rich.console import Console

from echostep_app.operation.operation import Operation
from echostep_app.operation.recorded.tape import Tape
from echostep_app.team.commander import as_tree

if TYPE_CHECKING:
    from echostep_app.operation.page import TablePage
    from echostep_app.page.server import Address


@dataclass(frozen=True, slots=True)
class Views:
    """Where a team is shown. `page` None: no page. `as_json`: the roster at the end, instead of the table."""

    page: Address | None = None
    as_json: bool = False


def open_page(
    opened: ExitStack, operation: Operation, title: str, views: Views, tape: Tape, console: Console
) -> TablePage | None:
    """The page, served until `opened` is closed, and its address printed; None where there is none."""
    if views.page is None:
        return None
    from echostep_app.operation.page import TablePage
    from echostep_app.page.web.addresses import print_page

    page = opened.enter_context(TablePage(operation, title, views.page, tape))
    print_page(console, page.server.urls)
    return page


def finish(operation: Operation, now_s: float, views: Views) -> None:
    """Print the roster where asked for; `now_s` on the operation's clock."""
    if views.as_json:
        json.dump(as_tree(operation.roster, operation.plan, now_s), sys.stdout, indent=2)
        sys.stdout.write("\n")
