# SPDX-License-Identifier: MIT
"""Messages of a beacon gateway, counted in words.

In: a `Gateway`. Out: a sentence. Owns nothing.
"""

from __future__ import annotations

from echostep.board.gateway import Gateway


def gateway_words(gateway: Gateway) -> str:
    """The counts that are not zero, as text."""
    counts = gateway.counts
    parts = [
        f"{value} {name.replace('_', ' ')}"
        for name in counts.__dataclass_fields__
        if name != "words" and (value := getattr(counts, name))
    ]
    rejected = f"; rejected: {', '.join(parts)}" if parts else ""
    numbers = ", ".join(map(str, sorted(gateway.duplicates)))
    duplicates = f"; two beacons have the number {numbers}" if numbers else ""
    return f"beacons: {len(gateway.numbers)} heard, {counts.words} readings{rejected}{duplicates}"
