# SPDX-License-Identifier: MIT
"""Resampling of the beliefs about beacons, particle by particle.

In: beliefs, the chosen particles. Out: the beliefs of those. Owns nothing.
"""

from __future__ import annotations

from echostep.aiding.beacons.beliefs import BeaconBeliefs
from echostep.arrays import Floats, Ints
from echostep.jit import kernel, lean_part


@kernel
def resample_beliefs(beliefs: BeaconBeliefs, chosen: Ints) -> None:
    """Copy the beliefs of the chosen particles (n,), in ascending order, in place; their number stays."""
    particles = len(beliefs.mean)
    _gather_rows(beliefs.mean.reshape(particles, -1), chosen)
    _gather_rows(beliefs.cov.reshape(particles, -1), chosen)
    _gather_rows(beliefs.doubt, chosen)


@lean_part
def _gather_rows(rows: Floats, chosen: Ints) -> None:
    """Set rows[i] = rows[chosen[i]] in place, for ascending `chosen`; `rows` (n, columns).

    Sources above their target are copied from the first row on, those below it from the last row back: each source is read before it is overwritten.
    """
    for i in range(len(chosen)):
        if chosen[i] > i:
            _copy_row(rows[chosen[i]], rows[i])
    for i in range(len(chosen) - 1, -1, -1):
        if chosen[i] < i:
            _copy_row(rows[chosen[i]], rows[i])


@lean_part
def _copy_row(source: Floats, target: Floats) -> None:
    """Set target[k] = source[k]. Slices of their own let the compiler copy several values at once."""
    for k in range(len(target)):
        target[k] = source[k]
