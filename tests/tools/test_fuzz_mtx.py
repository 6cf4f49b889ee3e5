# SPDX-License-Identifier: MIT
"""The fuzzer of the MTx decoder."""

from __future__ import annotations

from reliability.fuzz.mtx import fuzz


def test_the_fuzzer_finds_nothing() -> None:
    found = fuzz(60_000, 3)
    assert found["good"] > 20_000
    rejected = (
        "bad_checksum",
        "bad_length",
        "bad_quaternion",
        "not_finite",
        "out_of_range",
        "bad_counter",
        "incomplete",
    )
    assert all(found[reason] > 0 for reason in rejected)
