# SPDX-License-Identifier: MIT
"""What the commanders' shared messages have in common: types of fields, decoding, checks, and which of two counts.

In: payloads from untrusted senders. Out: their fields; BadReportError with the reason of a rejection. Owns nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Protocol, TypeVar

import msgspec
from msgspec import Meta

from echostep_app.team.messages.report import BadReportError, decode_as, is_printable

Identity = Annotated[str, Meta(pattern="^[0-9a-f]{8}$")]
Person = Annotated[str, Meta(min_length=1, max_length=32)]
UnixTime = Annotated[float, Meta(ge=0.0, le=1e11)]


class Signed(Protocol):
    """A message of the commander `by` at `unix_s`."""

    @property
    def by(self) -> str: ...
    @property
    def unix_s(self) -> float: ...


K = TypeVar("K")
T = TypeVar("T")
S = TypeVar("S", bound=Signed)


def is_older(one: Signed, other: Signed) -> bool:
    """Whether a message comes before another one; at one time, the names decide, so that all commanders agree."""
    return (one.unix_s, one.by) < (other.unix_s, other.by)


def keep_latest(known: dict[K, S], key: K, new: S) -> S | None:
    """Put a message among the known ones unless it is outdated; then returns the newer one that is known."""
    before = known.get(key)
    if before is not None and is_older(new, before):
        return before
    known[key] = new
    return None


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
