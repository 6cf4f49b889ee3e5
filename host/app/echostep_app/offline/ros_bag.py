# SPDX-License-Identifier: MIT
"""Bags of ROS 2: the samples of an Imu, a FluidPressure or a Range as a table.

In: a bag's folder, or its file (.db3, .mcap). Out: rows in SI at the times in the messages' headers; EchostepError for what is no such bag, and where
the topic has to be named. Owns nothing. Units and frames: REP 103, REP 105; a covariance that begins with -1, limits of a range: definitions of
sensor_msgs. Definitions that a bag brings are not used, for rosbags would compile them.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from echostep.arrays import Floats
from echostep.offline.imu_csv import COLUMNS, LIMITS
from echostep_app.extras import require
from echostep_app.offline.foreign_columns import Naming, factors_of
from echostep_app.printing.lines import faults_of

TOPICS = ("imu", "pressure", "left", "right")  # what --columns calls a topic
SIDES = TOPICS[2:]  # of ranges
FIXED = {"earth", "map", "odom", "world"}  # frames in which no sensor measures


class Kind(NamedTuple):
    """A type of message, and the columns of its table: t_s, then `values` of a message."""

    type: str
    columns: tuple[str, ...]
    values: Callable[[Any], tuple[float, ...]]


def _imu(message: Any) -> tuple[float, ...]:
    force, rate = message.linear_acceleration, message.angular_velocity
    lacks = message.linear_acceleration_covariance[0] == -1.0 or message.angular_velocity_covariance[0] == -1.0
    return (math.nan,) * 6 if lacks else (force.x, force.y, force.z, rate.x, rate.y, rate.z)


def _range(message: Any) -> tuple[float, ...]:
    return (message.range if message.min_range <= message.range <= message.max_range else math.nan,)


IMU = Kind("sensor_msgs/msg/Imu", COLUMNS, _imu)
FLUID_PRESSURE = Kind(
    "sensor_msgs/msg/FluidPressure", ("t_s", "pressure_pa"), lambda message: (message.fluid_pressure,)
)
RANGE = Kind("sensor_msgs/msg/Range", ("t_s", "range_m"), _range)


def is_bag(path: Path) -> bool:
    """Whether a file is named as a bag's, or a folder is one."""
    return path.suffix.lower() in (".db3", ".mcap") or (path / "metadata.yaml").is_file()


def read_bag(path: Path, kind: Kind, name: str, naming: Naming) -> tuple[Floats, tuple[str, ...]]:
    """Rows (n, k) and notes of the topic that --columns `name`=TOPIC states; else of the only one of this kind, for a side with it in its name."""
    require("a bag of ROS 2", "rosbags")
    with faults_of(path):
        if unknown := naming.columns.keys() - set(TOPICS):
            raise ValueError(f"--columns {min(unknown)}: a bag has no columns; {', '.join(TOPICS)} are names of topics")
        try:
            types, read = _messages(path, kind)
        except Exception as error:  # whatever rosbags and SQLite make of a damaged bag
            remedy = "of a damaged one ros2 bag reindex or mcap recover may save the rest"
            raise ValueError(f"no bag of ROS 2 that can be read: {error}; {remedy}") from error
        asked = naming.columns.get(name)
        fit = [topic for topic in read if (topic == asked if asked else name not in SIDES or name in topic)]
        if len(fit) != 1:
            found = f"{len(fit)} topics" if fit else "no messages"
            there = ", ".join(f"{topic} ({type_})" for topic, type_ in sorted(types.items()))[:300] or "none"
            raise ValueError(f"{found} of {kind.type} for {name}: say --columns {name}=TOPIC; there are {there}")
        frames, rows = zip(*read[fit[0]], strict=True)
        table = np.array(rows)
        if wrong := _complaint(frames, table, kind):
            raise ValueError(f"{fit[0]}: {wrong}")
        factors = factors_of(list(kind.columns), list(kind.columns), naming.units)
        return table * [factors.get(column, 1.0) for column in kind.columns], (f"read from {fit[0]}, a message a line",)


def _complaint(frames: tuple[str, ...], table: Floats, kind: Kind) -> str:
    """Why the rows of a topic are not those of one sensor; empty when they are."""
    several = sorted(set(frames))
    if len(table) > (LIMITS.lines or 0):
        return f"more than {LIMITS.lines} messages: cut the recording into parts"
    if len(several) > 1:
        return f"frames {', '.join(several)[:300]}: one sensor a topic is read"
    if kind is IMU and several[0].strip("/") in FIXED:
        return f"turned into the frame {several[0]}: samples in the sensor's own frame are needed"
    if np.isnan(table[:, 0]).all():
        return "the stamps of its headers are zero: let the driver stamp the samples"
    no_rates = kind is IMU and np.isnan(table[:, 1:]).all()
    return "no rates or no forces (covariance -1): record both" if no_rates else ""


def _messages(path: Path, kind: Kind) -> tuple[dict[str, str], dict[str, list[tuple[str, list[float]]]]]:
    """Types by topic; frame and row of each message of this kind by topic."""
    from rosbags.rosbag2 import Reader
    from rosbags.serde import SerdeError
    from rosbags.typesys import Stores, get_typestore

    humble, jazzy = get_typestore(Stores.ROS2_HUMBLE), get_typestore(Stores.ROS2_JAZZY)
    read: dict[str, list[tuple[str, list[float]]]] = {}
    with Reader(path) as bag:
        wanted = [each for each in bag.connections if each.msgtype == kind.type]
        for connection, _, data in islice(bag.messages(wanted) if wanted else (), 1 + (LIMITS.lines or 0)):
            try:
                message: Any = humble.deserialize_cdr(data, kind.type)
            except SerdeError:  # of Jazzy a Range has a variance
                message = jazzy.deserialize_cdr(data, kind.type)
            stamp_s = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec
            row = [stamp_s or math.nan, *kind.values(message)]
            read.setdefault(connection.topic, []).append((message.header.frame_id, row))
        return {each.topic: each.msgtype for each in bag.connections}, read
