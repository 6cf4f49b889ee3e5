# SPDX-License-Identifier: MIT
"""Sentences about wrong fields of messages from outside: the path, the value and what it should be, whatever the sender wrote."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import Meta, Struct

from echostep.fields import checked


@dataclass(frozen=True)
class Inner:
    """A part with a rule of its own."""

    share: float = 0.5
    kind: Literal["a", "b"] = "a"

    def __post_init__(self) -> None:
        """Raise ValueError for more than all."""
        if self.share > 1.0:
            raise ValueError("share: more than all")


class Message(Struct):
    """A message."""

    count: int
    at: list[Annotated[tuple[float, float], Meta(description="[x, y]")]] = []
    inner: Inner | None = None


@pytest.mark.parametrize(
    ("tree", "sentence"),
    [
        ([], "the file: [] is not an object"), ({}, "count: missing"), ({"count": 1.0}, "count: 1.0 is not a whole number"),
        ({"count": 1, "at": [[1, 2], [1]]}, "at[1]: [1] is not [x, y]"), ({"count": 1, "at": [[1, "x"]]}, "at[0][1]: 'x' is not a finite number"),
        ({"count": 1, "inner": 3}, "inner: 3 is not an object"), ({"count": 1, "inner": {"share": 2.0}}, "share: more than all"),
        ({"count": 1, "inner": {"share": 10**400}}, "inner.share: a huge number is not allowed"),
        ({"count": 1, "inner": {"kind": "x`\n - at `$.count"}}, r"inner.kind: 'x`\n - at `$.count' is not allowed"),
        ({"count": 1, "inner": {"kind": "\ud800"}}, r"'\ud800' is not a text that can be written as UTF-8"),
    ],
)  # fmt: skip
def test_a_wrong_field_in_words(tree: Any, sentence: str) -> None:
    with pytest.raises(ValueError) as caught:  # noqa: PT011
        checked(tree, Message)
    assert str(caught.value) == sentence


FIELDS = st.sampled_from(["count", "at", "inner", "share", "kind", "Object missing required field `x`"])
TREES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(st.characters(), max_size=4) | FIELDS,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(FIELDS, inner, max_size=4),
)


@given(TREES)
def test_any_tree_is_a_message_or_one_line(tree: Any) -> None:
    try:
        message = checked(tree, Message)
    except ValueError as error:
        assert "\n" not in str(error)  # noqa: PT017
    else:
        assert all(math.isnan(x) or isinstance(x, float) for point in message.at for x in point)
