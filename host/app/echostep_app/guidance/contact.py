# SPDX-License-Identifier: MIT
"""Contact with the beacons: when a wearer is sent back to the last known place, and when onward.

In: when and where the place was last known (a beacon measured), the present place by dead reckoning since. Out: whether to go back. Owns the fields
of a `Contact` record. `Guide` and the study of guided returns call the same kernels.

After a silence guidance leads back to where the place was last known. Without a measurement there either, it leads onward for twice as long, since
reception does not improve while the wearer waits.
"""

from __future__ import annotations

import math
from typing import Protocol

from echostep.arrays import record_dtype
from echostep.jit import kernel, part

# Assumed, not measured.
PERIODS = 1.5  # least silence, in usual times between measurements: one may be missing
PERIOD_KEPT = 0.9  # share of the usual time between measurements that stays after a shorter one
SAFE_S = 15.0  # of contact after which the allowed silence is the first one again
AT_PLACE_M = 1.0  # from the last known place: the wearer is there


class Contact(Protocol):
    """A record of floats. Times in seconds; places (m) in any one frame in which dead reckoning moves."""

    known_s: float  # when the place was last known
    known_x: float  # where that was
    known_y: float
    period_s: float  # usual time between measurements
    first_s: float  # since when there has been contact without a silence
    silent_since_s: float  # from when the silence counts: `known_s`, or the arrival back there without a measurement
    factor: float  # on the allowed silence: doubles after each return
    back: float  # 1: going back


CONTACT = record_dtype(Contact)


@kernel
def start_contact(contact: Contact, t_s: float, x: float, y: float) -> None:
    """The place is known."""
    contact.known_s, contact.known_x, contact.known_y = t_s, x, y
    contact.first_s, contact.silent_since_s = t_s, t_s
    contact.period_s, contact.factor, contact.back = 0.0, 1.0, 0.0


@kernel
def allowed_silence(contact: Contact, silence_s: float) -> float:
    """Time without a measurement (s) until the wearer has left the range, before any doubling; at least `silence_s`."""
    return max(silence_s, PERIODS * contact.period_s)


@kernel
def update_contact(
    contact: Contact, t_s: float, known_s: float, x: float, y: float, lost: bool, silence_s: float
) -> bool:
    """Whether the wearer, at (x, y) at `t_s`, is to go back to the last known place. `known_s`: when a beacon last measured.

    A lost estimate sends the wearer back at once, whatever beacons measure. After an arrival there without a measurement the wearer goes onward, for
    twice the time.
    """
    if not lost and known_s > contact.known_s:
        _note_known(contact, known_s, x, y)
    if contact.back and math.hypot(contact.known_x - x, contact.known_y - y) < AT_PLACE_M:
        contact.factor, contact.back, contact.silent_since_s = 2.0 * contact.factor, 0.0, t_s
    elif (
        lost and contact.silent_since_s == contact.known_s
    ) or t_s - contact.silent_since_s > contact.factor * allowed_silence(contact, silence_s):
        contact.back = 1.0
    return contact.back > 0.0


@part
def _note_known(contact: Contact, t_s: float, x: float, y: float) -> None:
    """The place is known: the allowed silence doubles after a return, and is the first one again after SAFE_S of contact.

    The usual time between measurements follows from the times without a return in between.
    """
    gap_s = t_s - contact.known_s
    was_back = contact.silent_since_s != contact.known_s
    contact.period_s = max(0.0 if was_back or contact.back else gap_s, PERIOD_KEPT * contact.period_s)
    if contact.back:
        contact.factor, contact.back, contact.first_s = 2.0 * contact.factor, 0.0, t_s
    elif was_back:
        contact.first_s = t_s
    elif t_s - contact.first_s > SAFE_S:
        contact.factor = 1.0
    contact.known_s, contact.known_x, contact.known_y, contact.silent_since_s = t_s, x, y, t_s
