# SPDX-License-Identifier: MIT
"""The foot's navigation behind gaitmap's interface: the same track as by `walk_track`, in the shape of gaitmap's methods; gaitmap's pins of numpy and
pandas exclude it from these tests, so that its base class is stood in for by one with the same property.
"""

from __future__ import annotations

import sys
from types import ModuleType
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation

from echostep.errors import EchostepError
from echostep.foot import walk_track
from foot.foot_walks import any_rotation, walking

NAMES = [f"{sensor}_{axis}" for sensor in ("acc", "gyr") for axis in "xyz"]
RATE_HZ = 100


@pytest.fixture
def method(monkeypatch: pytest.MonkeyPatch) -> Any:
    base: Any = ModuleType("gaitmap.base")
    base.BaseTrajectoryMethod = object
    monkeypatch.setitem(sys.modules, "gaitmap", ModuleType("gaitmap"))
    monkeypatch.setitem(sys.modules, "gaitmap.base", base)
    monkeypatch.delitem(sys.modules, "echostep_app.offline.gaitmap_method", raising=False)
    from echostep_app.offline.gaitmap_method import FootNavigation

    return FootNavigation


def data(walk: np.ndarray) -> pd.DataFrame:
    return pd.DataFrame(walk * [1.0, 1.0, 1.0, *[180.0 / np.pi] * 3], columns=NAMES)


def test_the_track_has_the_shape_of_gaitmaps_methods(method: Any) -> None:
    """Any mounting; the given orientation is the first one."""
    mounting = any_rotation(np.random.default_rng(2))
    _, accel, gyro = walking(6)
    walk = np.hstack([accel @ mounting.T, gyro @ mounting.T])
    plain = method().estimate(data(walk), sampling_rate_hz=RATE_HZ)
    track = walk_track(np.arange(len(walk)) / RATE_HZ, walk[:, :3], walk[:, 3:])
    assert np.allclose(plain.position_.to_numpy()[1:], track.position_m, atol=1e-9)
    assert list(plain.position_) == ["pos_x", "pos_y", "pos_z"]
    assert list(plain.velocity_) == ["vel_x", "vel_y", "vel_z"]
    assert plain.position_.index.name == "sample"
    assert len(plain.orientation_object_) == len(plain.velocity_) == len(walk) + 1
    moved = np.diff(plain.position_, axis=0) * RATE_HZ - plain.velocity_.to_numpy()[:-1]
    assert np.median(np.abs(moved)) < 0.01
    first = Rotation.from_euler("z", 2.0) * plain.orientation_object_[0]
    given = method(first.as_quat()).estimate(data(walk), sampling_rate_hz=RATE_HZ, stride_event_list=None)
    assert (given.orientation_object_[0] * first.inv()).magnitude() < 1e-9
    assert np.allclose(given.position_, Rotation.from_euler("z", 2.0).apply(np.array(plain.position_)))


def test_what_is_no_foots_walk_is_refused(method: Any) -> None:
    _, accel, gyro = walking(6)
    with pytest.raises(EchostepError, match="look like g"):
        method().estimate(data(np.hstack([accel / 9.80665, gyro])), sampling_rate_hz=RATE_HZ)
    with pytest.raises(ValueError, match="never still"):
        method().estimate(data(np.hstack([accel, gyro + 1.0])), sampling_rate_hz=RATE_HZ)
