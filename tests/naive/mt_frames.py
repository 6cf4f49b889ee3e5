# SPDX-License-Identifier: MIT
"""Slow, obviously right twin of the MT's frame reader: at each place of a whole capture, is there a valid frame?"""

from __future__ import annotations

BUSES = (*range(1, 33), 0xFF)


def valid_frames(capture: bytes) -> list[tuple[int, int, bytes]]:
    """Bus, message identifier and payload of each valid frame; the search goes on behind a valid frame, else one byte later."""
    found, begin = [], 0
    while begin < len(capture):
        size = frame_size(capture[begin : begin + 6])
        frame = capture[begin : begin + size]
        if size and len(frame) == size and sum(frame[1:]) % 256 == 0:
            head = 6 if frame[3] == 0xFF else 4
            found.append((frame[1], frame[2], frame[head:-1]))
            begin += size
        else:
            begin += 1
    return found


def frame_size(head: bytes) -> int:
    """Bytes of the frame that begins so; 0 when no frame does."""
    if len(head) < 4 or head[0] != 0xFA or head[1] not in BUSES:
        return 0
    if head[3] != 0xFF:
        return 5 + head[3]
    length = int.from_bytes(head[4:6], "big")
    return 7 + length if len(head) == 6 and 255 <= length <= 65535 else 0
