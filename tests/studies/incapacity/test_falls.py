# SPDX-License-Identifier: MIT
"""The study of falls, small; and the recordings, which hold no fall."""

from __future__ import annotations

from msgspec import UNSET, UnsetType

from echostep_studies.incapacity.fall_recordings import recorded
from echostep_studies.incapacity.falls import KITS, fallen, not_fallen, summarize, tables
from echostep_studies.simulation.falling import FALLS, NO_FALLS
from needs_data import data_or_skip


def stated(value: float | UnsetType) -> float:
    """A column that is there."""
    assert value is not UNSET
    return value


def test_falls_are_counted_by_kit_and_manner_and_the_belt_tells_them_all() -> None:
    rows = summarize([fallen(seed) for seed in range(3 * len(FALLS))])
    assert [row["name"] for row in rows[:4]] == [f"belt: {manner}" for manner in FALLS]
    assert len(rows) == len(KITS) * len(FALLS)
    assert all(row["told"] == row["runs"] and stated(row["longest_s"]) < 7.0 for row in rows[:4])
    assert all(13.0 < stated(row["mayday_s"]) < 17.0 for row in rows[:4])
    assert not any(row["early"] for row in rows)
    assert len(tables(rows)[0].rows) == len(rows)


def test_what_is_no_fall_is_counted_apart() -> None:
    rows = summarize([not_fallen(seed) for seed in range(0, 3 * len(NO_FALLS), 3)])
    assert all(row["claimed"] == 0 for row in rows)
    assert [row["name"] for row in rows] == [f"belt: {manner}" for manner in NO_FALLS]


def test_no_recording_of_feet_or_trunks_has_a_fall() -> None:
    rows = summarize(recorded(data_or_skip("vicon_pyshoe").parent))
    assert [row["name"] for row in rows] == ["recorded: feet", "recorded: trunks"]
    assert all(row["claimed"] == 0 and stated(row["watched_h"]) > 0.05 for row in rows)
