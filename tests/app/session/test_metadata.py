# SPDX-License-Identifier: MIT
"""The start in a recording's fields, as it was written and damaged."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from echostep.errors import EchostepError
from echostep.height.levels import Air
from echostep.localization import Start
from echostep.plan import NO_PLAN, Pose
from echostep.walk.recorded import recorded_start
from echostep_app.session.metadata import run_metadata

PATH = Path("walk.mcap")
AFTER_PAUSE = Start(Pose(1.0, 2.0, 0.5, 1), 0.3, math.pi, air=Air(12.0, 0.4), after_pause=True)
ROOM = Start(room_m=np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 3.0]]), level=2)


@pytest.mark.parametrize("start", [Pose(1.0, 2.0, 0.5, 1), Start(Pose(1.0, 2.0, 0.5), 0.3, 0.2), AFTER_PAUSE])
def test_a_start_is_read_as_it_was_written(start: Pose | Start) -> None:
    assert recorded_start(run_metadata(NO_PLAN, start, 1, ""), PATH) == start


def test_a_room_is_read_as_it_was_written() -> None:
    read = recorded_start(run_metadata(NO_PLAN, ROOM, 1, ""), PATH)
    assert isinstance(read, Start)
    assert read.level == 2
    np.testing.assert_array_equal(read.room_m, ROOM.room_m)


@pytest.mark.parametrize(
    ("start", "damage"),
    [
        *((Pose(1.0, 2.0, 0.5), {"start_x_y_rad": text}) for text in ("", "1,2", "nan,0,0", "0,inf,0", "1e300,0,0", "0,0,0,inf")),
        *((AFTER_PAUSE, {"start_sd_m_rad": text}) for text in ("0.1", "nan,0.1", "0.1,inf", "-0.1,0.1")),
        *(
            (AFTER_PAUSE, {"start_after_pause": json.dumps({"air": air})})
            for air in (3, {"zero_m": 1.0}, *({"zero_m": v, "sd_m": 0.1} for v in (math.nan, math.inf, 1e300)))
        ),
        *((AFTER_PAUSE, {"start_after_pause": json.dumps({"air": {"zero_m": 1.0, "sd_m": v}})}) for v in (math.nan, -1.0)),
        *((ROOM, {"start_room": json.dumps({"outline_m": o})}) for o in ([[math.nan, 0.0]], [[1.0]], "wall", [[1e300, 0.0]])),
    ],
    ids=str,
)  # fmt: skip
def test_a_damaged_start_is_refused(start: Pose | Start, damage: dict[str, str]) -> None:
    with pytest.raises(EchostepError, match="its recorded start is damaged: give one with --start"):
        recorded_start(run_metadata(NO_PLAN, start, 1, "") | damage, PATH)
