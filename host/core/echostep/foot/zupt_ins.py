# SPDX-License-Identifier: MIT
"""The foot's kernel: zero-velocity-aided inertial navigation, sample by sample, and the steps and stances that follow from it.

In: `Samples`, and the `ZuptInsState`. Out: rows of `Output`, which `steps` turns into events. The caller owns the `ZuptInsState`.

Navigation starts when the foot has been still long enough to be levelled, and again after samples were missing for too long.
Position and yaw errors count from the last stance, so every step has its own covariance. Floors are assumed level.
"""

from __future__ import annotations

import math

from echostep.arrays import Floats
from echostep.foot import ins, mounting, soft_limit, stance, unrest
from echostep.foot import magnetometer as magnetic
from echostep.foot import zupt_state as out
from echostep.foot.ins import POS, TILT, VEL, YAW, Nav
from echostep.foot.stance import SampleWindow
from echostep.foot.zupt_state import ImuSample, Output, Samples, ZuptInsState, ZuptState
from echostep.jit import lean_kernel, lean_part

CONFIRM_S = 0.03  # a stance is reported after this much rest
SETTLE_S = 0.2  # after this much rest the step before it has been corrected
LEAVE_S = 0.15  # a stance ends after this long without rest: no swing is shorter
PERIOD_GAIN = 0.003  # relative change of the running median per sample
GAP_S = 0.25  # shorter gaps are propagated over
# The same for a moving foot: its speed changes by metres per second in a tenth of a second; assumed
MOVING_GAP_S = 0.08
STRAY_SAMPLES = 20  # this many samples in a row with earlier times: the clock was set back
# Of a wearer while samples are missing, assumed: 1/e time of his pace before; 1 sd of what he does beside that, and of his foot beside him
GOES_ON_S, WALK_M_S, BESIDE_M = 4.0, 0.6, 0.4
START_M_S = 1.5  # of a foot that is levelled though it may move, 1 sd
MOST_M_S = 20.0  # of a sprinter's foot in its swing
MAX_ACCEL_M_S2, MAX_RATE_RAD_S = 1e3, 1e2  # beyond any foot
STEEP_M_S2, STEEP_RAD_S = 15.0, 4.0  # equal readings beyond these are a sensor at its limit, not a coincidence
LOST_SHARE = 0.3  # sd of the part that such a reading omits, as a share of the reading
LEVEL_S = 0.1  # still for this long: gravity can be measured
IMPATIENT_S = 3.0  # after this long without such a moment, any sample that may be a stance levels the foot
STILL_TILT_RAD, UNSURE_TILT_RAD = 0.05, 0.3
UNSURE_YAW_RAD2_S = 1.0
FLAT_M = 0.04  # a step that rises less is on a level floor, not on a stair, kerb or ramp
FLAT_SDS = 2.0  # a rise within this many standard deviations is drift: in a runner's step, whose sd is 0.05 to 0.1 m, always downwards
RISER_M = 0.15  # a greater rise may be a stair: least riser of ISO 21542


@lean_kernel
def process(foot: ZuptInsState, samples: Samples, output: Output) -> None:
    """Navigate through the samples in turn and fill `output`."""
    s, nav, rows = foot.zupt, foot.nav, output.rows
    t_s, accel, gyro, mag = samples
    for k in range(len(t_s)):
        if _usable(s, t_s[k], accel[k], gyro[k]):
            dt = t_s[k] - s.t_s if s.samples > 1 else 0.0
            bridged_s = MOVING_GAP_S if s.levelled and s.rest_s == 0.0 else GAP_S
            if s.samples > 1 and not 0.0 < dt <= bridged_s:
                _restart(foot, dt, output)
                dt = 0.0
            sample = ImuSample(dt, t_s[k], accel[k], gyro[k])
            _track_period(s, dt)
            stance.add_sample(foot.window, t_s[k], accel[k], gyro[k])
            if s.levelled:
                _navigate(foot, sample, output)
                if len(mag) and s.rest_s > 0.0:
                    magnetic.accumulate(foot.compass, nav, mag[k])
            else:
                _find_level(foot, sample, output)
            s.t_s = t_s[k]
            for i in range(3):
                s.force[i], s.rate[i] = accel[k, i], gyro[k, i]
        if len(rows):
            for i in range(3):
                rows[k, out.ROW_POSITION + i] = nav.position[i]
            rows[k, out.ROW_HEADING] = ins.heading(nav)
            rows[k, out.ROW_IN_STANCE] = s.in_stance * (1 - s.pushed)
            rows[k, out.ROW_EVENT_COUNT] = output.written[0]


@lean_part
def _usable(s: ZuptState, t_s: float, accel: Floats, gyro: Floats) -> bool:
    """Whether a sample is finite, possible and later than the last one; counts those that are not."""
    possible = math.isfinite(t_s)
    for i in range(3):
        possible = possible and abs(accel[i]) < MAX_ACCEL_M_S2 and abs(gyro[i]) < MAX_RATE_RAD_S  # false for NaN
    if not possible:
        s.impossible += 1
        return False
    if s.samples > 0 and t_s <= s.t_s:
        s.stray += 1
        if s.stray < STRAY_SAMPLES:
            s.not_later += 1
            return False
    s.stray = 0
    s.samples += 1
    return True


@lean_part
def _track_period(s: ZuptState, dt: float) -> None:
    """Running median of the sample period; missing samples do not bias it."""
    if s.period_s == 0.0:
        s.period_s = dt
    elif dt > 0.0:
        s.period_s *= 1.0 + PERIOD_GAIN if dt > s.period_s else 1.0 - PERIOD_GAIN


@lean_part
def _restart(foot: ZuptInsState, dt: float, output: Output) -> None:
    """Stop navigation until the next levelling: samples are missing, or clock or level are wrong. Ends the stance, inflates the yaw variance."""
    s, nav = foot.zupt, foot.nav
    s.gaps += 1
    span_s = min(max(dt, GAP_S), 3600.0)
    s.lost_s += span_s
    if s.in_stance:
        _end_stance(foot, output)
    nav.P[YAW, YAW] = min(nav.P[YAW, YAW] + UNSURE_YAW_RAD2_S * span_s, stance.UNKNOWN_YAW_RAD2)
    if s.levelled:
        s.yaw_rad = ins.heading(nav)
    stance.clear_rest(foot.sums)
    s.levelled = 0
    s.still_s = s.lasting_s = s.waited_s = s.rest_s = s.flight_s = 0.0


@lean_part
def _find_level(foot: ZuptInsState, sample: ImuSample, output: Output) -> None:
    """Level the foot after LEVEL_S of stillness, from the mean force; after IMPATIENT_S at any possible stance, with a larger tilt sd."""
    s, nav, dt, t_s = foot.zupt, foot.nav, sample.dt, sample.t_s
    stillness = stance.stillness_statistic(*stance.activity(foot.window, nav.gyro_bias))
    s.waited_s += dt
    s.still_s = s.still_s + dt if stillness < stance.STILL else 0.0
    force = stance.mean_force(foot.window)
    if s.still_s == 0.0:
        s.force_count = 0
    for i in range(3):
        s.force_sum[i] = s.force_sum[i] + force[i] if s.force_count else force[i]
    s.force_count += 1
    if s.still_s >= LEVEL_S - 1e-6:
        n, total = s.force_count, s.force_sum
        ins.set_level(nav, (total[0] / n, total[1] / n, total[2] / n), s.yaw_rad, True)
        _start_navigation(s, nav, t_s, STILL_TILT_RAD, 0.02)
        _begin_stance(s, nav, t_s - s.still_s, output)
    elif s.waited_s >= IMPATIENT_S and stillness < 1.0:
        ins.set_level(nav, force, s.yaw_rad, False)
        _start_navigation(s, nav, t_s, UNSURE_TILT_RAD, START_M_S)
        _begin_stance(s, nav, t_s, output)


@lean_part
def _start_navigation(s: ZuptState, nav: Nav, t_s: float, tilt_sd_rad: float, velocity_sd_m_s: float) -> None:
    """Start navigation at this sample. In the unobserved time the wearer went on at his pace, and slowed down."""
    ins.set_covariance(nav, tilt_sd_rad, velocity_sd_m_s, nav.noise.gyro_bias, nav.noise.accel_bias)
    if s.lost_s > 0.0:
        lost_s = s.lost_s + s.waited_s
        pace_s = max(s.stride_s, t_s - lost_s - s.stance_begin_s)
        for_s = GOES_ON_S * (1.0 - math.exp(-lost_s / GOES_ON_S))
        for i in range(3):
            nav.position[i] += for_s * s.stride_m[i] / pace_s if s.stride_s > 0.0 else 0.0
            nav.P[POS + i, POS + i] = BESIDE_M**2 + (WALK_M_S * lost_s) ** 2
    s.lost_s = 0.0
    s.levelled = 1
    s.rest_end_s = t_s


@lean_part
def _navigate(foot: ZuptInsState, sample: ImuSample, output: Output) -> None:
    """One sample of navigation: propagate, detect stance, update, write events."""
    s, nav, window, sums, _ = foot
    dt, t_s, accel, gyro = sample
    ins.propagate(nav, dt, s.period_s, s.force, accel, s.rate, gyro)
    # A push that was taken for a tilt, wrong samples: nothing that was learnt is right
    if ins.dot(nav.velocity, nav.velocity) > MOST_M_S**2:
        for i in range(3):
            nav.gyro_bias[i] = 0.0
            nav.accel_bias[i] = 0.0
        _restart(foot, dt, output)
        return
    _inflate_at_limits(s, nav, dt, accel, gyro)
    s.saturated += soft_limit.restore(nav, window, s.period_s, s.rate_peak, s.rate_plateau)
    if not s.in_stance:
        s.swing_rad_s = max(s.swing_rad_s, math.sqrt(ins.dot(gyro, gyro)))
        s.flight_s += dt
    else:
        unrest.feel_push(s, nav, accel, gyro, dt)
    if not _update_if_resting(s, nav, window, sample):
        stance.clear_rest(sums)
        s.rest_s = 0.0
        if not s.in_stance:
            mounting.accumulate(s.tilt_square, s.tilt_cube, ins.difference(mounting.tilt(nav), s.stance_tilt), dt)
        if s.in_stance and t_s - s.rest_end_s >= LEAVE_S - 1e-6:
            _end_stance(foot, output)
        return
    s.rest_s += dt
    s.rest_end_s = t_s
    s.rest_yaw_rad = ins.heading(nav)
    if stance.zero_angular_rate_update(nav, sums, dt, s.rate, gyro) or (not s.settled and s.rest_s >= SETTLE_S):
        _settle(s, nav)
    if not s.in_stance and s.rest_s >= CONFIRM_S - 1e-6:
        rise_m = nav.position[2] - s.origin[2]
        if abs(rise_m) < FLAT_M:
            ins.update(nav, POS + 2, -rise_m, nav.noise.flat_m**2)
        elif abs(rise_m) < min(FLAT_SDS * math.sqrt(nav.P[POS + 2, POS + 2]), RISER_M):
            ins.reset_height(nav, s.origin[2])
        _begin_stance(s, nav, t_s - s.rest_s, output)


@lean_part
def _update_if_resting(s: ZuptState, nav: Nav, window: SampleWindow, sample: ImuSample) -> bool:
    """Detect rest by both tests of `stance` and apply the zero-velocity update; returns whether the foot rests.

    A rest against the gate is accepted if it lasts, or if no rest was accepted for long; then the covariance is inflated first. If a foot has
    rested and is still, and everything that contradicts this is vertical, the floor moves: a lift.
    """
    dt, t_s = sample.dt, sample.t_s
    rate2, force2 = stance.activity(window, nav.gyro_bias)
    stillness = stance.stillness_statistic(rate2, force2)
    _track_calm(s, nav, window, stillness, dt)
    if stillness > stance.most_activity(s.swing_rad_s):
        return False
    expected = stance.standing_velocity(nav, window, s.height_m)
    if s.rest_s >= SETTLE_S and stance.may_ride(rate2, force2):  # an accelerating floor shows in the present velocity
        expected = (expected[0], expected[1], 0.0)
    variance = stance.rest_variance(nav, rate2)
    level, vertical = stance.normalized_innovation(nav, expected, variance, stance.mean_force(window))
    if s.rest_s >= SETTLE_S and level <= stance.GATE < level + vertical and stance.may_ride(rate2, force2):
        stance.follow_floor(nav, expected, variance)
    elif level + vertical > stance.GATE:
        since_s = t_s - s.rest_end_s
        if s.lasting_s < stance.LASTING_S and since_s < stance.OVERDUE_S:
            return False
        s.forced += 1
        east, north, _ = ins.difference(nav.velocity, expected)
        s.pushed = 1 if east * east + north * north > unrest.PUSHED_M_S**2 else s.pushed
        stance.inflate_covariance(nav, (level + vertical) / stance.GATE)
    else:
        unrest.accumulate(s, nav, sample.gyro, level, dt)
    # The foot may still decelerate: by its acceleration over half the window
    braking = (0.5 * stance.WINDOW_S) ** 2 * force2
    stance.zero_velocity_update(nav, expected, variance + braking, dt)
    return True


@lean_part
def _track_calm(s: ZuptState, nav: Nav, window: SampleWindow, stillness: float, dt: float) -> None:
    """Duration of the present calm, in which a foot feels gravity alone and from one direction: a gliding foot feels its braking."""
    force = ins.apply(ins.rotation(nav.attitude), stance.mean_force(window))
    if stillness >= stance.CALM or not stance.feels_gravity_alone(window):
        s.lasting_s = 0.0
        return
    change = ins.difference(force, s.lasting_force)
    if s.lasting_s == 0.0 or ins.dot(change, change) > stance.STEADY_M_S2**2:
        s.lasting_force[0], s.lasting_force[1], s.lasting_force[2] = force
        s.lasting_s = 0.0
    s.lasting_s += dt


@lean_part
def _inflate_at_limits(s: ZuptState, nav: Nav, dt: float, accel: Floats, gyro: Floats) -> None:
    """Inflate velocity, tilt and yaw variances while an axis repeats a reading near the end of its range: the true value is unknown."""
    for i in range(3):
        s.force_limit_s[i] = s.force_limit_s[i] + dt if accel[i] == s.force[i] and abs(accel[i]) > STEEP_M_S2 else 0.0
        s.rate_limit_s[i] = s.rate_limit_s[i] + dt if gyro[i] == s.rate[i] and abs(gyro[i]) > STEEP_RAD_S else 0.0
        force = _limit_variance(accel[i], s.force_limit_s[i], dt)
        rate = _limit_variance(gyro[i], s.rate_limit_s[i], dt)
        if force + rate > 0.0:
            s.saturated += 1
            r = ins.rotation(nav.attitude)
            axis = (r[0][i], r[1][i], r[2][i])
            for j in range(3):
                for k in range(3):
                    nav.P[VEL + j, VEL + k] += force * axis[j] * axis[k]
                    nav.P[TILT + j, TILT + k] += rate * axis[j] * axis[k]
            nav.P[YAW, YAW] += rate * axis[2] ** 2


@lean_part
def _limit_variance(value: float, span_s: float, dt: float) -> float:
    """Growth over `dt` of the variance of the integral of `value`, at its limit for `span_s` with a constant error."""
    return (LOST_SHARE * value) ** 2 * (2.0 * span_s - dt) * dt if span_s > 0.0 else 0.0


@lean_part
def _begin_stance(s: ZuptState, nav: Nav, begin_s: float, output: Output) -> None:
    """Begin a stance; write the step that led to it if there was a stance before."""
    s.in_stance = 1
    s.settled = 0
    s.stride_s = begin_s - s.stance_begin_s if s.walking else 0.0
    for i in range(3):
        s.stride_m[i] = nav.position[i] - s.origin[i]
    s.stance_begin_s = max(begin_s, s.stance_end_s) if s.walking else begin_s
    s.rest_yaw_rad = ins.heading(nav)
    s.stance_tilt[0], s.stance_tilt[1], s.stance_tilt[2] = mounting.tilt(nav)
    if s.walking:
        _write_step(s, nav, output.events[output.written[0]])
        output.written[0] += 1
    s.walking = 1
    s.origin[0], s.origin[1], s.origin[2] = nav.position[0], nav.position[1], nav.position[2]
    s.yaw_variance = nav.P[YAW, YAW]


@lean_part
def _write_step(s: ZuptState, nav: Nav, row: Floats) -> None:
    """Fill an event row with the step since `origin`; fade the sums of the mounting."""
    row[out.KIND], row[out.START_S], row[out.END_S] = out.STEP, s.stance_end_s, s.stance_begin_s
    for i in range(3):
        row[out.MOVE + i] = nav.position[i] - s.origin[i]
        for j in range(3):
            row[out.COVARIANCE + 3 * i + j] = nav.P[POS + i, POS + j]
    row[out.HEADING] = s.rest_yaw_rad
    row[out.HEADING_SD] = math.sqrt(max(nav.P[YAW, YAW] - s.yaw_variance, 0.0))
    row[out.TOE] = mounting.toe(s.tilt_square, s.tilt_cube)
    offset = ins.dot(ins.rotation(nav.attitude)[2], nav.accel_bias)
    row[out.EXCESS] = offset / ins.GRAVITY_M_S2 if abs(offset) > nav.noise.offset else 0.0
    row[out.UNREST] = max(s.unrest if s.judged >= unrest.FEWEST else 0.0, s.flight_s / unrest.LONGEST_FLIGHT_S)
    for i in range(3):
        s.tilt_square[i] *= mounting.MEMORY
        s.tilt_cube[i] *= mounting.MEMORY


@lean_part
def _settle(s: ZuptState, nav: Nav) -> None:
    """Count the errors of the next step from here."""
    s.settled = 1
    ins.reset_reference(nav)


@lean_part
def _end_stance(foot: ZuptInsState, output: Output) -> None:
    """Write the stance, which ended with its last rest, and apply the magnetometer's yaw correction."""
    s, nav, row = foot.zupt, foot.nav, output.events[output.written[0]]
    output.written[0] += 1
    row[out.KIND], row[out.START_S], row[out.END_S] = out.STANCE, s.stance_begin_s, max(s.rest_end_s, s.stance_begin_s)
    row[out.HEADING] = s.rest_yaw_rad
    s.stance_end_s = row[out.END_S]
    s.in_stance = s.pushed = 0
    s.swing_rad_s = s.flight_s = 0.0
    unrest.judge(s, row[out.END_S] - row[out.START_S])
    if not s.settled:
        _settle(s, nav)
    yaw = ins.heading(nav)
    turn = magnetic.correction(foot.compass, nav, s.rest_yaw_rad)
    if turn != 0.0:
        ins.turn(nav, s.origin, turn - (ins.heading(nav) - yaw))
        s.rest_yaw_rad += turn
        s.yaw_variance = min(s.yaw_variance, nav.P[YAW, YAW])
