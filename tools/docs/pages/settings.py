# SPDX-License-Identifier: MIT
"""host/docs/settings.md: every section and field of the settings, from their dataclasses.

In: `echostep.settings`. Out: the page. Owns nothing.
"""

from __future__ import annotations

import dataclasses
import inspect
from typing import Any

from docs.pages import MADE
from echostep.settings import Settings

SETTINGS = """\
`--settings FILE` of `live` and `replay`: TOML, one section a stage, every field has a default. A wrong section, field or value is
named. A recording keeps the settings that it was tracked with, and `replay` uses them. Lengths in metres, times in seconds, unless
a name ends otherwise.
"""


def page() -> str:
    """Every section and field of the settings."""
    parts = ["# Settings\n", MADE, SETTINGS]
    for stage in dataclasses.fields(Settings):
        default = getattr(Settings(), stage.name)
        rows = [f"{f.name} = {_toml(getattr(default, f.name))}" for f in dataclasses.fields(default)]
        parts.append(f"## [{stage.name}]\n\n{inspect.cleandoc(type(default).__doc__ or '')}\n")
        parts.append("```toml\n" + "\n".join([f"[{stage.name}]", *rows]) + "\n```\n")
    return "\n".join(parts)


def _toml(value: Any) -> str:
    return str(value).lower() if isinstance(value, bool) else repr(value)
