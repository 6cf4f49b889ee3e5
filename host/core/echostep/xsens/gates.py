# SPDX-License-Identifier: MIT
"""The gates on a measurement's values and on its counter, applied before the tracker uses it.

In: decoded messages, limits, the state of the gates. Out: which messages are samples. The caller owns the state and the tally.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from echostep.arrays import Bools, Floats, Ints
from echostep.jit import kernel, part
from echostep.xsens.mtdata import ACCEL, ATTITUDE, COLUMNS, GYRO, MAG

# Results of the gates, in the order of the gates; also entries of the tally. LOST is an entry only.
GOOD, OTHER_DEVICE, INCOMPLETE, NOT_FINITE, BAD_QUATERNION, OUT_OF_RANGE, REPEATED, BAD_COUNTER, LOST = range(9)
TALLIED = (  # the same in `MtxCounts`
    "good", "other_device", "incomplete", "not_finite", "bad_quaternion", "out_of_range", "repeated", "bad_counter", "lost",
)  # fmt: skip

# Samples; after a larger jump of the counter the sample waits until the next counter confirms it; assumed
MAX_GAP = 500
# The state of the gates; -1: none. ACCEPTED: last accepted counter. DEVICE: bus of the followed device. OTHER, OTHERS: last counter of a message
# that is no sample, and how many of them came since ACCEPTED.
ACCEPTED, DEVICE, OTHER, OTHERS = range(4)
# Groups of values: columns of `Decoded.sent` and entries of the limits; their number
_ACCEL, _GYRO, _MAG, _ATTITUDE, _GROUPS = range(5)
_BEGIN = (ACCEL.start, GYRO.start, MAG.start, ATTITUDE.start, ATTITUDE.stop)  # first column of each group, and the end
_Q = ATTITUDE.start  # column of the quaternion's w


class Messages(NamedTuple):
    """Measurement messages: the fields of `Decoded`, the `bus` (n,) of the device, and `end` (n,) as in `MtBatch`."""

    values: Floats
    counter: Ints
    sent: Bools
    bus: Ints
    end: Ints

    def at(self, index: Ints) -> Messages:
        """The messages with these indices (k,)."""
        return Messages(self.values[index], self.counter[index], self.sent[index], self.bus[index], self.end[index])


NO_MESSAGES = Messages(
    np.zeros((0, COLUMNS)), np.zeros(0, np.int64), np.zeros((0, 4), np.bool_), np.zeros(0, np.int64), np.zeros(0, np.int64)
)  # fmt: skip


def joined(waiting: Messages, newer: Messages) -> Messages:
    """The waiting message, if any, and the newer ones."""
    if not len(waiting.counter):
        return newer
    return Messages(*(np.concatenate(pair) for pair in zip(waiting, newer, strict=True)))


@kernel
def apply_gates(messages: Messages, limits: Floats, state: Ints, tally: Ints) -> tuple[Bools, int]:
    """Whether each message (n,) is a sample that passes every gate, and the index of a message that waits for the next (-1: none).

    Updates `state`, and `tally` by the results. A sample that had to wait gets the `end` of the one that confirmed it. The gates are needed
    because the checksum has 8 bits: one damaged frame in 256 passes it.
    """
    values, counter, sent, bus, end = messages
    passed = np.zeros(len(values), np.bool_)
    waits = -1
    for k in range(len(values)):
        result = _sample_gate(values[k], counter[k], sent[k], bus[k], state, limits)
        if result == INCOMPLETE:
            _note_other(counter[k], bus[k], state)
        if result == GOOD:
            result = _counter_gate(counter[k], counter[waits] if waits >= 0 else -1, state)
        if result == BAD_COUNTER:  # it waits; the one that waited until now was not confirmed
            tally[BAD_COUNTER] += waits >= 0
            waits = k
            continue
        tally[result] += 1
        if result != GOOD:
            continue
        if waits >= 0:
            confirmed = ((counter[k] - state[ACCEPTED]) & 0xFFFF) > MAX_GAP  # else it follows the last accepted one
            tally[GOOD if confirmed else BAD_COUNTER] += 1
            if confirmed:
                passed[waits], end[waits] = True, end[k]
                _accept(counter[waits], bus[waits], state, tally)
            waits = -1
        passed[k] = True
        _accept(counter[k], bus[k], state, tally)
    return passed, waits


@part
def _sample_gate(row: Floats, counter: int, sent: Bools, bus: int, state: Ints, limits: Floats) -> int:
    """GOOD for a whole, possible sample of the followed device, else the first gate that it fails."""
    if counter < 0 or not sent[_ACCEL] or not sent[_GYRO]:
        return INCOMPLETE
    if state[DEVICE] >= 0 and bus != state[DEVICE]:
        return OTHER_DEVICE
    return _value_gate(row, sent, limits)


@part
def _note_other(counter: int, bus: int, state: Ints) -> None:
    """Note the counter of a message that is no sample: devices count satellite messages with the samples."""
    if counter < 0 or bus != state[DEVICE] or counter == state[OTHER]:
        return
    if 0 < ((counter - state[ACCEPTED]) & 0xFFFF) <= MAX_GAP:
        state[OTHER] = counter
        state[OTHERS] += 1


@part
def _counter_gate(counter: int, waiting: int, state: Ints) -> int:
    """GOOD for a counter that follows the last accepted one or the one that waits (-1: none), REPEATED for one of these two, else BAD_COUNTER."""
    if state[ACCEPTED] < 0:
        return GOOD
    if counter in (state[ACCEPTED], waiting):
        return REPEATED
    follows = ((counter - state[ACCEPTED]) & 0xFFFF) <= MAX_GAP
    confirms = waiting >= 0 and ((counter - waiting) & 0xFFFF) <= MAX_GAP
    return GOOD if follows or confirms else BAD_COUNTER


@part
def _accept(counter: int, bus: int, state: Ints, tally: Ints) -> None:
    """Make this the last accepted counter, and count the counters missing before it as lost, except after a jump back."""
    gap = (counter - state[ACCEPTED]) & 0xFFFF
    if state[ACCEPTED] >= 0 and gap < 0x8000:
        others = state[OTHERS] - (1 if state[OTHER] == counter else 0)
        tally[LOST] += max(gap - 1 - others, 0)
    state[ACCEPTED], state[DEVICE] = counter, bus
    state[OTHER], state[OTHERS] = -1, 0


@part
def _value_gate(row: Floats, sent: Bools, limits: Floats) -> int:
    """The first gate that a sample fails, for the quantities that were sent: finite, |q| = 1, within the sensor's range."""
    for group in range(_GROUPS):
        for column in range(_BEGIN[group], _BEGIN[group + 1]):
            if sent[group] and not np.isfinite(row[column]):
                return NOT_FINITE
    if sent[_ATTITUDE]:
        square = row[_Q] ** 2 + row[_Q + 1] ** 2 + row[_Q + 2] ** 2 + row[_Q + 3] ** 2
        if abs(np.sqrt(square) - 1.0) > limits[_ATTITUDE]:
            return BAD_QUATERNION
    for group in range(_ATTITUDE):
        for column in range(_BEGIN[group], _BEGIN[group + 1]):
            if sent[group] and abs(row[column]) > limits[group]:
                return OUT_OF_RANGE
    return GOOD
