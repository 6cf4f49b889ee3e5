# SPDX-License-Identifier: MIT
"""Runs of the ports' messages in an MCAP file, as portions.

In: the bytes of a file or of a decompressed chunk record, possibly damaged or hostile. Out: `Portion`s, and the messages' numbers. Owns nothing.
Messages of other channels than the ports' are skipped.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from mcap.opcode import Opcode
from mcap.records import Channel

from echostep.arrays import Bools, Ints, Octets
from echostep.jit import kernel
from echostep.ports.chunks import LATEST_NS, Portion
from echostep.recording import mcap_records
from echostep.recording.damage.ending import Ending
from echostep.recording.damage.scan import record_end
from echostep.recording.mcap_records import is_misnamed, parse_record, port_of, read_uint

PORTION_BYTES = 1 << 18  # of the file in one portion, approximately: about five seconds of a walk; assumed


@dataclass(frozen=True, slots=True)
class MessageRun:
    """Consecutive messages of the ports, and the number of each."""

    portion: Portion
    sequence: Ints


@dataclass
class PortChannels:
    """Channels read so far: `names` of ports; for each channel number the index into `names` (-1: no port), and `known`: whether it was read.

    `misnamed`: topics of channels that carry bytes of a port but are not named as one, or the reverse: one of the two is damaged.
    """

    names: tuple[str, ...] = ()
    port_of_channel: Ints = field(default_factory=lambda: np.full(mcap_records.CHANNEL_IDS, -1, np.int64))
    known: Bools = field(default_factory=lambda: np.zeros(mcap_records.CHANNEL_IDS, np.bool_))
    misnamed: set[str] = field(default_factory=set)
    _settled: set[int] = field(default_factory=set)  # numbers of the channels in a trusted summary

    def add_summary(self, ending: Ending) -> None:
        """Add the channels that are repeated at the end; no later record changes the channels of a trusted summary."""
        for opcode, body in ending.summary:
            if opcode == Opcode.CHANNEL and (channel := parse_record(Channel, body)):
                self.add(body)
                self._settled |= {channel.id} if ending.trusted else set()

    def add(self, body: bytes) -> None:
        """Add the channel of a channel record; its number may have had another meaning before."""
        channel = parse_record(Channel, body)
        if channel is None or channel.id in self._settled:
            return
        self.known[channel.id], self.port_of_channel[channel.id] = True, -1
        if name := port_of(channel):
            self.names = tuple(dict.fromkeys((*self.names, name)))
            self.port_of_channel[channel.id] = self.names.index(name)
        elif is_misnamed(channel):
            self.misnamed.add(channel.topic)


def read_messages(file: Octets, offset: int, channels: PortChannels) -> tuple[MessageRun | None, int]:
    """The ports' messages among the consecutive valid messages from `offset` on, about `PORTION_BYTES` of them; and the offset after them."""
    stop = min(offset + PORTION_BYTES, len(file))
    most = (stop - offset) // (mcap_records.HEAD_SIZE + mcap_records.MESSAGE_SIZE) + 1
    port, t_arrival_ns, sequence, start, end = (np.empty(most, np.int64) for _ in range(5))
    count, next_offset = _read_run(
        file, offset, stop, channels.port_of_channel, channels.known, (port, t_arrival_ns, sequence, start, end)
    )
    if not count:
        return None, next_offset
    received = file[offset:next_offset].tobytes()
    portion = Portion(
        channels.names, port[:count], t_arrival_ns[:count], start[:count] - offset, end[:count] - offset, received
    )
    return MessageRun(portion, sequence[:count]), next_offset


@kernel
def _read_run(
    file: Octets,
    offset: int,
    stop: int,
    port_of_channel: Ints,
    known: Bools,
    columns: tuple[Ints, Ints, Ints, Ints, Ints],
) -> tuple[int, int]:
    """Fill the columns port, arrival, number, start and end from the messages before `stop`; returns the number of rows, and where the run ends."""
    port, t_arrival_ns, sequence, start, end = columns
    count = 0
    while offset < stop and file[offset] == mcap_records.MESSAGE:
        after = record_end(file, offset, known)
        if after < 0:
            break
        body, offset = offset + mcap_records.HEAD_SIZE, after
        if port_of_channel[read_uint(file, body, 2)] >= 0:
            port[count] = port_of_channel[read_uint(file, body, 2)]
            log_time_ns = read_uint(file, body + mcap_records.LOG_TIME_OFFSET, 8)
            t_arrival_ns[count] = log_time_ns if 0 <= log_time_ns <= LATEST_NS else LATEST_NS
            sequence[count] = read_uint(file, body + mcap_records.SEQUENCE_OFFSET, 4)
            start[count], end[count] = body + mcap_records.MESSAGE_SIZE, after
            count += 1
    return count, offset
