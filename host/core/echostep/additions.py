# SPDX-License-Identifier: MIT
"""Names that are loaded when they are first used: the names of a package's face, and names that other installed distributions add.

In: a name. Out: the object of a package's module; the one that a distribution registers under this name, as an entry point of the group `echostep`
(pictures, plans of other formats, longitude and latitude, the other commands). Owns nothing. So this package imports nothing that is built on it.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

from echostep.errors import EchostepError


def face(package: str) -> Callable[[str], Any]:
    """`__getattr__` of a package, so that importing it costs nothing: the names are those that it imports for type checkers alone."""
    homes: dict[str, str] = {}

    def load(name: str) -> Any:
        if not homes:
            homes.update(_imported(package))
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        if homes[name] != package and hasattr(home := import_module(homes[name]), name):
            return getattr(home, name)
        return import_module(f"{homes[name]}.{name}")

    return load


def _imported(package: str) -> dict[str, str]:
    """Modules of the names that a package imports where `TYPE_CHECKING` holds, by its source."""
    import ast
    from pkgutil import get_data

    source = get_data(package, "__init__.py") or b""
    blocks = [node.body for node in ast.parse(source).body if isinstance(node, ast.If)]
    imports = [node for body in blocks for node in body if isinstance(node, ast.ImportFrom)]
    return {alias.name: str(node.module) for node in imports for alias in node.names}


def added(name: str) -> Any | None:
    """The object registered under this name; None if no distribution adds one."""
    from importlib.metadata import entry_points  # with a parser of mail: 20 ms

    return next((entry.load() for entry in entry_points(group="echostep", name=name)), None)


def needed(name: str, what: str) -> Any:
    """The object registered under this name; raises EchostepError that names `what`."""
    if (found := added(name)) is None:
        raise EchostepError(f"{what} needs echostep-app, which is not installed: pip install 'echostep[app]'")
    return found


def svg_of(shown: object) -> str | None:
    """The picture of an object, for a notebook; None if nothing draws it, so that the repr is shown."""
    pictures = added("pictures")
    return pictures.svg(shown) if pictures else None
