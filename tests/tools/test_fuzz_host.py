# SPDX-License-Identifier: MIT
"""The small version of `make fuzz-host`: inputs that once were faults, and some mutations on every way into the host."""

from __future__ import annotations

import signal
from collections.abc import Iterator

import pytest

from reliability.fuzz import host as fuzz_host
from reliability.fuzz.targets import TARGETS

SLOW = {"dxf": 2, "ifc": 3, "osm": 3, "wrld": 5, "wrld-floor": 2}  # inputs, where one takes tens of milliseconds


@pytest.fixture(autouse=True)
def limited() -> Iterator[None]:
    before = signal.signal(signal.SIGALRM, fuzz_host.too_slow)
    yield
    signal.signal(signal.SIGALRM, before)


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(TARGETS))
def test_mutated_inputs_are_no_fault(name: str) -> None:
    count, data, text = fuzz_host.run_shard(name, 0, 60.0, SLOW.get(name, 20))
    assert text == "", data.hex()
    assert count == SLOW.get(name, 20)


def test_inputs_that_once_were_faults_are_none() -> None:
    kept = list(fuzz_host.kept_inputs())
    assert len(kept) >= 4
    for name, data in kept:
        assert fuzz_host.fault(name, data) == ""
