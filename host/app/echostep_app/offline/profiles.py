# SPDX-License-Identifier: MIT
"""Other methods for recorded feet and legs, which other distributions bring: the papers' methods come with `echostep-studies`.

In: entry points of the group `echostep.profiles`, named `foot.NAME` and `legs.NAME`. Out: the method. Owns nothing.
"""

from __future__ import annotations

from importlib.metadata import entry_points
from typing import TypeVar

from echostep.errors import EchostepError

Method = TypeVar("Method")

DEFAULT = "default"  # the method of this project
GROUP = "echostep.profiles"


def method(part: str, name: str, own: Method) -> Method:
    """The method of a profile for a part, `foot` or `legs`; a profile has the signature of `own`. Raises EchostepError."""
    if name == DEFAULT:
        return own
    methods = {entry.name: entry for entry in entry_points(group=GROUP)}
    if f"{part}.{name}" in methods:
        loaded: Method = methods[f"{part}.{name}"].load()
        return loaded
    known = [DEFAULT, *sorted(entry.removeprefix(f"{part}.") for entry in methods if entry.startswith(f"{part}."))]
    more = "" if methods else "; those of the papers come with: pip install echostep-studies"
    raise EchostepError(f"--profile {name}: {part} has no such profile; it has {', '.join(known)}{more}")
