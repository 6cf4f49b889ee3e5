# SPDX-License-Identifier: MIT
"""Lengths of the wearer's leg as typed by the user: checked, and scaled by a walk of known length.

In: lengths (m) from the command line or the wizard. Out: `LegLengths`, the scale; or an EchostepError that names the option. Owns nothing.
"""

from __future__ import annotations

from echostep.errors import EchostepError
from echostep.legs.kinematics import USUAL_M, LegLengths

# All assumed.
LENGTH_RANGE_M = (0.2, 0.75)  # thigh or shank: a quarter of a height of 0.8 m, and 0.285 (to the floor) of 2.6 m
CENTIMETRES = (15.0, 80.0)  # a number in this range is a length in centimetres: LENGTH_RANGE_M with a margin
WALKED_RANGE_M = (3.0, 1000.0)  # length of the walk: two strides at least, and what can be measured on the ground
SCALE_RANGE = (0.3, 3.0)  # computed over true length; beyond it another walk or unit is likely: 3.28 feet are a metre


def checked_lengths(thigh_m: float | None, shank_m: float | None, scale: float = 1.0) -> LegLengths:
    """The lengths, when a person can have them, the usual ones for None; raises EchostepError otherwise."""
    thigh_m, shank_m = (USUAL_M if length is None else length for length in (thigh_m, shank_m))
    for name, length in (("--thigh", thigh_m), ("--shank", shank_m)):
        if not LENGTH_RANGE_M[0] <= length <= LENGTH_RANGE_M[1]:
            hint = ": in centimetres? give metres" if CENTIMETRES[0] < length < CENTIMETRES[1] else ""
            raise EchostepError(
                f"{name} {length:g}: no such leg, expected {LENGTH_RANGE_M[0]} to {LENGTH_RANGE_M[1]} m{hint}"
            )
    return LegLengths(thigh_m, shank_m, scale)


def calibrated_scale(distance_m: float, walked_m: float) -> float:
    """Factor on all stride lengths: true length `walked_m` of a walk over its computed length; raises EchostepError when they do not fit."""
    if not WALKED_RANGE_M[0] <= walked_m <= WALKED_RANGE_M[1]:
        raise EchostepError(
            f"--walked {walked_m:g}: expected the length of the walk in metres, 3 to 1000, best 10 or more"
        )
    if distance_m < SCALE_RANGE[0] * walked_m or distance_m > SCALE_RANGE[1] * walked_m:
        raise EchostepError(
            f"--walked {walked_m:g}: these samples hold {distance_m:.2f} m: is it the same walk, and are the legs in metres?"
        )
    return walked_m / distance_m
