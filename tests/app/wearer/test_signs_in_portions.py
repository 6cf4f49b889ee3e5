# SPDX-License-Identifier: MIT
"""The wearer's signs do not depend on how the chunks are cut."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from echostep.ports.chunks import portion_of
from echostep_app.wearer.alarm import AlarmWatch
from echostep_app.wearer.wearer_signs import Sign
from odometry.test_front_end import front_end, recorded


def signs(cuts: list[int]) -> list[Sign]:
    """Of a recorded walk with damage on both ports, in portions cut there."""
    ours, watch, chunks = front_end(), AlarmWatch(), recorded()
    ours.watch = watch
    edges = sorted({0, len(chunks), *(c % len(chunks) for c in cuts)})
    for a, b in zip(edges, edges[1:], strict=False):
        ours.process(portion_of(chunks[a:b]))
    return watch.pop()


@pytest.mark.slow
@given(st.lists(st.integers(0, 1 << 20), max_size=40))
@settings(max_examples=25, deadline=None)
def test_any_portions_give_the_same_signs(cuts: list[int]) -> None:
    assert signs(cuts) == signs([])
