# SPDX-License-Identifier: MIT
"""What the commanders' shared messages have in common: types of fields, decoding, checks.

In: payloads from untrusted senders. Out: their fields; BadReportError with the reason of a rejection. Owns nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, TypeVar

import msgspec
from msgspec import Meta

from echostep.team.messages.report import BadReportError, decode_as, is_printable

Identity = Annotated[str, Meta(pattern="^[0-9a-f]{8}$")]
Person = Annotated[str, Meta(min_length=1, max_length=32)]
UnixTime = Annotated[float, Meta(ge=0.0, le=1e11)]
K = TypeVar("K")
T = TypeVar("T")


def check_printable(*texts: str) -> None:
    """Raises BadReportError for a text with letters that are not printed."""
    if not all(map(is_printable, texts)):
        raise BadReportError("unprintable text")


def check_room(known: Mapping[K, object], key: K, most: int, what: str) -> None:
    """Raises BadReportError for a new key where `most` are known."""
    if key not in known and len(known) >= most:
        raise BadReportError(f"more than {most} {what}")


def decoded(payload: bytes, decoder: msgspec.json.Decoder[T], what: str) -> T:
    """The fields of a payload; raises BadReportError for one that is no valid `what`."""
    try:
        return decode_as(payload, decoder)
    except BadReportError as error:
        raise BadReportError(f"not a valid {what}: {error}") from error
