# SPDX-License-Identifier: MIT
"""host/docs/python.md: the public Python API, from its docstrings.

In: `echostep.__all__`, and `__all__` of the packages in it. Out: the page. Owns nothing.
"""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from enum import Enum
from typing import Any, ForwardRef, Literal, get_origin

import echostep
from docs.pages import MADE

LINE = 100  # characters: the width of the page
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
    described = callable(value) and get_origin(value) is not Literal
    text = fenced(inspect.cleandoc(value.__doc__ or "")) if described else f"`{value!r}`".replace("typing.", "")
    if described and text.startswith(f"{name}("):
        text = ""  # a dataclass or tuple without a docstring of its own
    methods = "".join(_methods(value)) if inspect.isclass(value) else ""
    call = f"```python\n{signature}\n```\n\n" if (signature := _signature(name, value)) else ""
    return f"### {name}\n\n{call}{text}\n{methods}"


def fenced(text: str) -> str:
    """A docstring with its examples, which begin with `>>>` and end with an empty line, as code blocks."""
    parts = text.split("\n\n")
    return "\n\n".join(f"```python\n{part}\n```" if part.startswith(">>>") else part for part in parts)


def _methods(value: type) -> Iterator[str]:
    if issubclass(value, Enum):
        yield "\n" + ", ".join(f"`{member.name}`" for member in value) + "\n"
        return
    for name, member in sorted(vars(value).items()):
        if name.startswith("_") or not (inspect.isfunction(member) or isinstance(member, property)):
            continue
        text = inspect.cleandoc(member.__doc__ or "").split("\n\n")[0].replace("\n", " ")
        if text:
            yield f"\n- `{name if isinstance(member, property) else ' '.join(_signature(name, member).split())}`: {text}"
    yield "\n"


def _signature(name: str, value: Any) -> str:
    """The call as it is written in the source, one parameter a line where it does not fit into LINE characters; empty for what is not called."""
    if not callable(value) or get_origin(value) is Literal or (inspect.isclass(value) and issubclass(value, Enum)):
        return ""
    signature = inspect.signature(value)
    parts: list[str] = []
    for parameter in signature.parameters.values():
        if parameter.kind is parameter.KEYWORD_ONLY and "*" not in parts:
            parts.append("*")
        if not parameter.name.startswith("_") and parameter.name != "self":
            parts.append(_parameter(parameter))
    returns = "" if inspect.isclass(value) else f" -> {_annotation(signature.return_annotation)}"
    if len(line := f"{name}({', '.join(parts)}){returns}") <= LINE:
        return line
    return f"{name}(\n" + "".join(f"    {part},\n" for part in parts) + f"){returns}"


def _parameter(parameter: inspect.Parameter) -> str:
    """`name: type = default`; a default that is long, or made for each call, is `...`."""
    text = f"{parameter.name}: {_annotation(parameter.annotation)}"
    if parameter.default is parameter.empty:
        return text
    default = str(parameter.default) if isinstance(parameter.default, Enum) else repr(parameter.default)
    return f"{text} = {'...' if default == '<factory>' or len(default) > LINE else default}"


def _annotation(value: Any) -> str:
    """A type as it is written in the source."""
    if isinstance(value, ForwardRef):
        return value.__forward_arg__
    return value if isinstance(value, str) else inspect.formatannotation(value)
