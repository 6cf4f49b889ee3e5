# SPDX-License-Identifier: MIT
"""Which MT a device is, by its product code; the MTx's successors are the MTi 1 and 600 series.

In: answers of the device. Out: text, and the largest force that the device measures. Owns nothing.
"""

from __future__ import annotations

import re

# By series, of MTi [MTi 1-series and MTi 600-series data sheets, as remembered: compare them with a copy]
FORCE_RANGE_G = {"1": 16.0, "600": 10.0}
_TEXT = re.compile(r"[ -~]+")


def product_text(code: bytes) -> str:
    """The product code as text, "" unless it is printable, padded with blanks or zeros [LLCP, ProductCode]."""
    text = code.rstrip(b"\0").decode("latin-1").strip()
    return text if _TEXT.fullmatch(text) else ""


def firmware_text(answer: bytes) -> str:
    """Major, minor and revision of the firmware; "" for another answer [LLCP, FirmwareRevision]."""
    return ".".join(map(str, answer[:3])) if len(answer) >= 3 else ""


def force_range_g(product: str) -> float | None:
    """Largest force in g of an MTi by its product code, as `MTi-3-8A7G6`; None if unknown."""
    match = re.match(r"MTi-(\d+)", product)
    if match is None:
        return None
    number = int(match[1])
    return FORCE_RANGE_G.get("1" if number < 10 else "600" if 600 <= number < 700 else "")
