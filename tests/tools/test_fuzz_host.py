# SPDX-License-Identifier: MIT
"""The small version of `make fuzz-host`: inputs that once were faults, and some mutations on every way into the host."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice

import pytest

from echostep.errors import EchostepError
from reliability.fuzz import host as fuzz_host
from reliability.fuzz.targets import TARGETS

# Inputs, where one takes tens of milliseconds, or some microseconds
COUNTS = {"dxf": 2, "ifc": 3, "osm": 3, "imdf": 5, "mtdata": 1000, "mtdata2": 1000, "packets": 1000}


@pytest.fixture(autouse=True)
def limited() -> Iterator[None]:
    before = signal.signal(signal.SIGALRM, fuzz_host.too_slow)
    yield
    signal.signal(signal.SIGALRM, before)


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(TARGETS))
def test_mutated_inputs_are_no_fault(name: str) -> None:
    most = COUNTS.get(name, 20)
    count, data, text = fuzz_host.run_shard(name, 0, 60.0, most)
    assert text == "", data.hex()
    assert count == most


def test_inputs_that_once_were_faults_are_none() -> None:
    kept = list(fuzz_host.kept_inputs())
    assert len(kept) >= 4
    for name, data in kept:
        assert fuzz_host.fault(name, data) == ""


@pytest.mark.parametrize(("error", "is_fault"), [(KeyError("x"), True), (EchostepError("x"), False)])
def test_only_an_error_in_words_is_no_fault(monkeypatch: pytest.MonkeyPatch, error: Exception, is_fault: bool) -> None:
    def take(_: bytes) -> object:
        raise error

    monkeypatch.setitem(TARGETS, "board", replace(TARGETS["board"], take=take))
    assert bool(fuzz_host.fault("board", b"x")) == is_fault


def test_shards_are_repeatable_and_differ() -> None:
    one, again, other = (list(islice(fuzz_host.inputs("plan", shard), 20)) for shard in (1, 1, 2))
    assert one == again
    assert one[1:] != other[1:]
