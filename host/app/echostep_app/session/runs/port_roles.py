# SPDX-License-Identifier: MIT
"""Whether each port has the device that its option names, by its bytes: at the start, and whenever a port was opened again.

In: chunks of live ports. Out: the same chunks, under the name of the device that sent them; EchostepError that names ports which are swapped at the
start. Owns the first bytes of each port.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace

from echostep.errors import EchostepError
from echostep.ports.chunks import Chunk
from echostep_app.ports.serial_ports import SerialPorts
from echostep_app.recording.device import DEVICES, LISTENED_BYTES, sender, wrong_device

CHECK_BYTES = 512  # between two looks at a port: some frames
SURE_BYTES = 4 * CHECK_BYTES  # by which a device is surely another one than before; assumed
HELD_NS = 2_000_000_000  # longest time that the bytes of a port which was opened again wait for their sender to be known; assumed


def with_role_check(chunks: Iterable[Chunk | None], urls: Mapping[str, str]) -> Iterator[Chunk | None]:
    """The same chunks; raises EchostepError as soon as a port's bytes are the other device's. `urls`: by name of the port."""
    unknown = {name: bytearray() for name in DEVICES if name in urls}
    due = dict.fromkeys(unknown, CHECK_BYTES)
    for chunk in chunks:
        yield chunk
        if chunk is None or chunk.port not in unknown:
            continue
        received = unknown[chunk.port]
        received += chunk.data
        if len(received) < due[chunk.port]:
            continue
        due[chunk.port] = 2 * len(received)
        device = sender(bytes(received))
        if device is not None and device != chunk.port:
            raise EchostepError(wrong_device(chunk.port, device, urls))
        if device or len(received) > LISTENED_BYTES:
            del unknown[chunk.port]


def with_right_names(chunks: Iterable[Chunk | None], ports: SerialPorts) -> Iterator[Chunk | None]:
    """The same chunks, each under the name of the device that sent it, after boards have exchanged their ports while they were unplugged."""
    names = _Names(ports)
    for chunk in chunks:
        if chunk is None or (chunk.port not in names.held and chunk.data):
            yield chunk if chunk is None or chunk.port not in names.device else names.named(chunk)
        else:
            known = names.take(chunk)
            yield from known
            if not known:
                yield None  # so that those who wait for a time see it pass


class _Names:
    """`device`: the name of the device on each port, by the name under which it was opened. `held`: chunks of ports that were opened again."""

    def __init__(self, ports: SerialPorts) -> None:
        self.device = {name: name for name in DEVICES if name in ports.names}
        self.held: dict[str, list[Chunk]] = {}
        self._refused: set[str] = set()  # ports with a device that has no place in this run
        self._ports = ports

    def named(self, chunk: Chunk) -> Chunk:
        """The chunk under the name of its device."""
        return chunk if self.device[chunk.port] == chunk.port else replace(chunk, port=self.device[chunk.port])

    def take(self, chunk: Chunk) -> list[Chunk]:
        """Hold a chunk, an empty one being the sign that its port was opened again; returns those whose sender is known now."""
        port = chunk.port
        if port not in self.device:
            return []
        if not chunk.data:
            self.held[port] = []
            self._refused.discard(port)
            return []
        if port in self._refused:
            return []
        waiting = self.held[port]
        waiting.append(chunk)
        received = b"".join(each.data for each in waiting)
        device = sender(received) if len(received) >= CHECK_BYTES else None
        if device != self.device[port] and len(received) < SURE_BYTES:
            device = None  # a foot board's first frames may be those of any board
        if device is None and chunk.t_arrival_ns - waiting[0].t_arrival_ns < HELD_NS:
            return []
        if device is not None and device != self.device[port] and not self._exchanged(port, device):
            waiting.clear()
            return []
        return [self.named(each) for each in self.held.pop(port)]

    def _exchanged(self, port: str, device: str) -> bool:
        """Exchange the names of two ports, if the one that had this device was opened again too; otherwise refuse this port's bytes."""
        other = next((name for name, known in self.device.items() if known == device), None)
        own = self.device[port]
        if other is None or (other not in self.held and other not in self._ports.lost):
            self._refused.add(port)
            self._ports.notices.append(f"{own}: {wrong_device(own, device, self._ports.urls)}; its bytes are not used")
            return False
        self.device[port], self.device[other] = device, own
        self._ports.exchange(own, device)
        self._ports.notices.append(
            f"{own} and {device} have exchanged their ports: {self._ports.urls[own]} is {DEVICES[own]} now"
        )
        return True
