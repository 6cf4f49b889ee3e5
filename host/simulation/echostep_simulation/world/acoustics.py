# SPDX-License-Identifier: MIT
"""Sound level of an echo, in dB against a wall straight ahead at one metre, and whether an SRF02 detects it.

In: the geometry of one echo. Out: its level. Owns the one table of acoustic constants, `Acoustics`; the likelihood shares none of it.

The rangers' transducer is taken as a piston: it sends and hears with the same directivity, so that an echo has it twice. Added to
this are the spreading of the wave, the absorption by the air and the losses at reflectors; an echo above the noisy threshold is detected. The
range therefore shrinks toward the rim of the cone, and is shorter for a small reflector than for a wall [Girard 2011, 2.6.2, 2.6.3].
"""

from __future__ import annotations

import math
from typing import NamedTuple

from echostep.jit import kernel, part

SILENT_DB = -1e3
# Of a piston's directivity 2 J1(x) / x; the side lobes beyond are 17 dB down each way and not modelled
FIRST_NULL = 3.8317
PIPE_RADIUS_M = 0.0275  # the 55 mm pipe of [Girard 2011, Figure 2a]


class Acoustics(NamedTuple):
    """Constants of the detection of an echo; levels in dB against a wall on the axis at 1 m."""

    speed_m_s: float = 343.2  # of sound, dry air at 20 degC
    size: float = 4.797  # wave number x piston radius: -6 dB at 27.5 degrees each way, the 55 degree cone [Robot Electronics, sonar FAQ]
    absorption_db_m: float = 1.3  # 40 kHz, 20 degC, 50 % humidity [ISO 9613-1]
    frame_radius_m: float = 0.01  # a wall's end echoes like a rod of this radius: the rounded profile of a door frame
    bounce_db: float = -1.5  # each reflection after the first
    body_db: float = -8.0  # passing by the wearer
    body_m: float = 0.2  # half the width of the trunk
    threshold_db: float = -28.6  # a wall on the axis is heard half of the time at 6 m [SRF02 technical specification]
    threshold_sd_db: float = 1.5  # of the comparison, from ping to ping
    minimum_m: float = 0.15  # the transducer still rings [SRF02 technical specification]
    maximum_m: float = 6.0  # the ranger stops listening
    # Which wavefront crosses the threshold, phasing; with the bias 3-4 cm [Robot Electronics, sonar FAQ]
    noise_m: float = 0.025
    bias_m: float = 0.025  # standard deviation over rangers
    # Share of the first echoes that are missed though they are loud enough, and share of the places where the beam meets a wall that scatter it back
    # if no echo came by mirrors. Known of other rangers in a small room (`evaluate echoes`), not of an SRF02 in a building
    missed: float = 0.0
    scatter: float = 0.0
    # Level of such a place against a wall, assumed: ghosts reach 3.4 m of a ranger's 4.5 m [real sweeps of 40 kHz rangers]
    scatter_db: float = -6.0


SRF02 = Acoustics()
# Pulse rangers [HC-SR04 user guide: 2 to 450 cm, best within 30 degrees, accuracy of 3 mm]: two pistons, a narrower cone (-6 dB at 15 degrees each
# way), a wall on the axis heard half of the time at 4.5 m. Noise and bias are assumed: a wavelength is 8.6 mm.
PULSE_RANGER = Acoustics(size=8.56, threshold_db=-22.2, minimum_m=0.02, maximum_m=4.5, noise_m=0.008, bias_m=0.01)
# I2CXL-MaxSonar-EZ0 [MaxBotix PD11848: 25 to 765 cm in steps of 1 cm, 42 kHz]: a piston of 7.5 mm (from memory), a wall on the axis heard half of the
# time at 7.65 m. Noise and bias are assumed.
MAXSONAR = Acoustics(size=5.77, threshold_db=-35.0, minimum_m=0.25, maximum_m=7.65, noise_m=0.01, bias_m=0.015)


def speed_of_sound_m_s(temperature_c: float) -> float:
    """Speed of sound in dry air, an ideal gas: 343.2 m/s at 20 degC."""
    return 331.3 * math.sqrt(1.0 + temperature_c / 273.15)


@kernel
def directivity_db(off_axis_rad: float, size: float) -> float:
    """Level at an angle off the axis against the axis, one way: 2 J1(x) / x by its power series [Kinsler et al. 2000, 7.4]."""
    x = size * math.sin(min(abs(off_axis_rad), 0.5 * math.pi))
    if x >= FIRST_NULL:
        return SILENT_DB
    term = 1.0
    total = 1.0
    for k in range(1, 12):
        term *= -0.25 * x * x / (k * (k + 1))
        total += term
    return 20.0 * math.log10(max(total, 1e-9))


@part
def path_db(range_m: float, off_out_rad: float, off_in_rad: float, bounces: int, a: Acoustics) -> float:
    """Level of an echo from flat walls: half the way of the sound, angles off the axis when it leaves and when it comes back."""
    spread = -20.0 * math.log10(max(range_m, 1e-3)) - 2.0 * a.absorption_db_m * (range_m - 1.0)
    turned = directivity_db(off_out_rad, a.size) + directivity_db(off_in_rad, a.size)
    return spread + turned + a.bounce_db * (bounces - 1)


@kernel
def wall_db(distance_m: float, off_axis_rad: float, a: Acoustics) -> float:
    """Level of a wall whose nearest point is at this distance and angle off the axis [Girard 2011, Figure 1b, c]."""
    return path_db(distance_m, off_axis_rad, off_axis_rad, 1, a)


@kernel
def rod_db(distance_m: float, off_axis_rad: float, radius_m: float, a: Acoustics) -> float:
    """Level of an upright rod: a wall's level, less the spreading by its curved face, sqrt(radius / (radius + distance)) in amplitude."""
    return wall_db(distance_m, off_axis_rad, a) + 10.0 * math.log10(radius_m / (radius_m + distance_m))
