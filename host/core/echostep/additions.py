# SPDX-License-Identifier: MIT
"""What other installed distributions add to this one: pictures, plans of other formats, the other commands.

In: a name. Out: the object that a distribution registers under it, as an entry point of the group `echostep`. Owns nothing. So nothing here imports
what is built on it.
"""

from __future__ import annotations

from importlib.metadata import entry_points
from typing import Any

from echostep.errors import EchostepError


def added(name: str) -> Any | None:
    """The object registered under this name; None where no distribution adds one."""
    for entry in entry_points(group="echostep", name=name):
        return entry.load()
    return None


def needed(name: str, what: str) -> Any:
    """The object registered under this name; raises EchostepError that says what needs it."""
    if (found := added(name)) is None:
        raise EchostepError(f"{what} needs echostep-app, which is not installed: pip install 'echostep[app]'")
    return found


def svg_of(shown: object) -> str | None:
    """The picture of an object, for a notebook; None, so that the repr is shown, where nothing draws."""
    pictures = added("pictures")
    return pictures.svg(shown) if pictures else None
