# SPDX-License-Identifier: MIT
"""State, input and output of the foot's kernel (`zupt_ins`).

In: nothing. Out: records and column names. Owns nothing.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

from echostep.arrays import Floats, Ints, record_dtype
from echostep.foot.ins import Nav
from echostep.foot.magnetometer import Magnetometer
from echostep.foot.stance import SampleWindow, ZaruSums

STEP, STANCE = 0.0, 1.0  # kinds of event
# Columns of an event: MOVE has 3, COVARIANCE 9.
KIND, START_S, END_S, MOVE, COVARIANCE, HEADING, HEADING_SD, TOE, EXCESS, UNREST = 0, 1, 2, 3, 6, 15, 16, 17, 18, 19
EVENT_SIZE = 20
EVENTS_PER_SAMPLE = 2
ROW_POSITION, ROW_HEADING, ROW_IN_STANCE, ROW_EVENT_COUNT = 0, 3, 4, 5  # columns of a row: ROW_POSITION has 3
ROW_SIZE = 6


class ZuptState(Protocol):
    """State of the foot besides its navigation: last sample, levelling, present rest, last step, counts. A numpy record in the kernel."""

    t_s: float
    period_s: float  # running median of the time between samples
    force: Floats
    rate: Floats
    levelled: int
    yaw_rad: float  # given to the attitude at levelling
    waited_s: float  # for levelling
    still_s: float
    lasting_s: float  # of calm in which gravity alone is felt, from one direction
    lasting_force: Floats  # specific force (walk frame) when it began
    force_sum: Floats
    force_count: int
    lost_s: float  # of missing samples, not yet in the covariance
    force_limit_s: Floats  # duration of each axis at its limit
    rate_limit_s: Floats
    rate_peak: Floats  # greatest rate of each axis
    rate_plateau: Floats  # height of its last plateau, see `soft_limit`; 0: none yet
    swing_rad_s: float  # greatest rate since the last stance
    rest_s: float
    rest_end_s: float
    rest_yaw_rad: float
    in_stance: int
    settled: int
    stance_tilt: Floats  # tilt of the foot in the last stance
    tilt_square: Floats  # of the swings, see `mounting`
    tilt_cube: Floats
    stance_begin_s: float
    stance_end_s: float  # of the stance before
    walking: int  # whether there was a stance before
    origin: Floats  # position at the last reported step
    stride_m: Floats  # the last step, and the time from stance to stance; 0: none yet
    stride_s: float
    yaw_variance: float  # at the last reported step
    stray: int
    samples: int
    impossible: int
    not_later: int
    saturated: int
    gaps: int
    forced: int
    flight_s: float  # observed time since the last stance
    roll: Floats  # rad, the turn about level axes in this stance, see `unrest`
    strain: float  # sum over the samples of rest in this stance
    strained: int  # their number
    unrest: float
    judged: int  # stances in it
    height_m: float  # of the sensor above the sole's contact with the floor
    push_s: float  # of this stance, see `unrest`
    push_gravity: Floats
    push_m_s: Floats
    pushed: int  # the floor moves


class ZuptInsState(NamedTuple):
    """All state of one foot."""

    zupt: ZuptState
    nav: Nav
    window: SampleWindow
    sums: ZaruSums
    compass: Magnetometer


class Samples(NamedTuple):
    """Samples t_s (n,), accel m/s2 and gyro rad/s (n, 3), mag (n, 3) or (0, 3), body frame."""

    t_s: Floats
    accel: Floats
    gyro: Floats
    mag: Floats


class ImuSample(NamedTuple):
    """One sample, `dt` s after the one before: accel m/s2 and gyro rad/s (3,)."""

    dt: float
    t_s: float
    accel: Floats
    gyro: Floats


class Output(NamedTuple):
    """`events` (2n, EVENT_SIZE), the first `written` (1,) are filled; `rows` (n, ROW_SIZE) after each sample, or (0, ROW_SIZE) where not wanted."""

    events: Floats
    rows: Floats
    written: Ints


ZUPT_STATE = record_dtype(ZuptState, array_size=3)
