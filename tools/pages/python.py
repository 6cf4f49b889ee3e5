"""host/docs/python.md: the public Python API, from its docstrings.

In: `echostep.__all__`, and `__all__` of the packages in it. Out: the page. Owns nothing.
"""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Iterator
from enum import Enum
from typing import Any

import echostep
from pages import MADE

HEAD = """# Python
{made}
What is listed here keeps its names; everything else may move between versions. All of it is typed.

"""


def page() -> str:
    """Each public name with its signature and its docstring."""
    parts = [HEAD.format(made=MADE), f"## echostep\n\n{inspect.cleandoc(echostep.__doc__ or '')}\n"]
    packages = []
    for name in echostep.__all__:
        value = getattr(echostep, name)
        if inspect.ismodule(value):
            packages.append(value)
        else:
            parts.append(_entry(name, value))
    for package in packages:
        parts.append(
            f"## {package.__name__.replace('.board.messages', '.messages')}\n\n{inspect.cleandoc(package.__doc__ or '')}\n"
        )
        names = getattr(package, "__all__", [])
        parts += [_entry(name, getattr(package, name)) for name in names]
        if not names:
            parts.append("Its classes: [protocol/README.md](../../protocol/README.md).\n")
    return "\n".join(parts)


def _entry(name: str, value: Any) -> str:
    """One name: heading, docstring, public methods."""
    text = inspect.cleandoc(value.__doc__ or "") if callable(value) else f"`{value!r}`"
    if callable(value) and text.startswith(f"{name}("):
        text = ""  # a dataclass or tuple without a docstring of its own
    methods = "".join(_methods(value)) if inspect.isclass(value) else ""
    heading = f"### {name}{_signature(value)}" if callable(value) else f"### {name}"
    return f"{heading}\n\n{text}\n{methods}"


def _methods(value: type) -> Iterator[str]:
    if issubclass(value, Enum):
        yield "\n" + ", ".join(f"`{member.name}`" for member in value) + "\n"
        return
    for name, member in sorted(vars(value).items()):
        if name.startswith("_") or not (inspect.isfunction(member) or isinstance(member, property)):
            continue
        text = inspect.cleandoc(member.__doc__ or "").split("\n\n")[0].replace("\n", " ")
        if text:
            yield f"\n- `{name}{'' if isinstance(member, property) else _signature(member)}`: {text}"
    yield "\n"


def _signature(value: Any) -> str:
    """Parameters and result as they are written in the source."""
    if inspect.isclass(value) and issubclass(value, Enum):
        return ""
    try:
        return str(inspect.signature(value)).replace("self, ", "").replace("(self)", "()").replace("'", "")
    except (TypeError, ValueError):
        return ""


def public_names() -> list[str]:
    """Every public name with its package."""
    found = [f"echostep.{name}" for name in echostep.__all__]
    for package in ("echostep.plan", "echostep.foot", "echostep.xsens"):
        found += [f"{package}.{name}" for name in importlib.import_module(package).__all__]
    return found
