# SPDX-License-Identifier: MIT
"""Whether each port has the device that its option names, by what comes from it.

In: chunks of live ports, after they were recorded. Out: the same chunks; EchostepError that names ports which are swapped. Owns the first bytes of
each port.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from echostep.errors import EchostepError
from echostep.ports.chunks import Chunk
from echostep.recording.device import DEVICES, LISTENED_BYTES, sender, wrong_device

CHECK_BYTES = 512  # between two looks at a port: some frames


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
