# SPDX-License-Identifier: MIT
"""The study `doubt`: what is not measured is not claimed, in short."""

from __future__ import annotations

import pytest

from echostep_studies.doubt.study import KINDS, doubt_run

FALSE_S = 2.0  # in a row


@pytest.mark.parametrize(("name", "end_m"), [("fallen-off", 1.0), ("carried", 1.0), ("lift", 4.0)])
def test_what_is_not_measured_is_not_believed(name: str, end_m: float) -> None:
    (row,) = doubt_run([name], 3)
    assert row.false_s < FALSE_S
    assert row.end_m < end_m  # by the legs, found again, a floor off


@pytest.mark.parametrize("name", ["none", "passers-by"])
def test_who_passes_sets_nothing_off(name: str) -> None:
    (row,) = doubt_run([name], 7702)
    assert (row.false_s, row.tracking > 0.98) == (0.0, True)


@pytest.mark.long
@pytest.mark.parametrize("name", [name for name in KINDS if not name.startswith(("start", "plan", "trolley"))])
def test_every_kind_is_honest_but_those_that_the_results_name(name: str) -> None:
    assert doubt_run([name], 2)[0].false_s < FALSE_S
