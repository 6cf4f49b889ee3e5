# SPDX-License-Identifier: MIT
"""Parts common to the commanders' shared messages: types of fields, decoding, checks, and which of two is valid.

In: payloads from untrusted senders. Out: their fields; BadReportError with the reason of a rejection. Owns those that are known; their number is
bounded.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Annotated, Protocol, TypeVar

import msgspec
from msgspec import Meta

from echostep_app.team.messages.report import BadReportError, decode_as, is_printable

Identity = Annotated[str, Meta(pattern="^[0-9a-f]{8}$")]
Person = Annotated[str, Meta(min_length=1, max_length=32)]
Message = tuple[str, bytes]  # topic and payload
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


def check_printable(*texts: str) -> None:
    """Raises BadReportError for a text with letters that are not printed."""
    if not all(map(is_printable, texts)):
        raise BadReportError("unprintable text")


def check_room(known: Mapping[K, object], key: K, most: int, what: str) -> None:
    """Raises BadReportError for a new key where `most` keys exist."""
    if key not in known and len(known) >= most:
        raise BadReportError(f"more than {most} {what}")


def decoded(payload: bytes, decoder: msgspec.json.Decoder[T], what: str) -> T:
    """The fields of a payload; raises BadReportError for one that is no valid `what`."""
    try:
        return decode_as(payload, decoder)
    except BadReportError as error:
        raise BadReportError(f"not a valid {what}: {error}") from error


class Kept(dict[K, S]):
    """Messages of one kind by their keys: of each key the latest, or the `earliest`."""

    def __init__(
        self, kind: type[S], what: str, most: int, message: Callable[[K, S], Message], texts: Callable[[S], Iterable[str]], *,
        earliest: bool = False,
    ) -> None:  # fmt: skip
        """`what`: one in words; `most` keys; `message`: topic and payload of one; `texts`: its printed fields."""
        super().__init__()
        self._decoder, self._what, self._most, self._earliest = msgspec.json.Decoder(kind), what, most, earliest
        self._message, self._texts = message, texts

    @property
    def messages(self) -> Iterator[Message]:
        """Topic and payload of each."""
        return (self._message(key, known) for key, known in self.items())

    def receive(self, key: K, message: Message, answers: deque[Message]) -> None:
        """Take one message, an empty one removes; an outdated one is answered with the present state. Raises BadReportError."""
        topic, payload = message
        if not payload:
            self.pop(key, None)
            return
        known, new = self.get(key), decoded(payload, self._decoder, self._what)
        if self._message(key, new)[0] != topic:
            raise BadReportError(f"{self._what} and topic contradict each other")
        check_printable(*self._texts(new))
        check_room(self, key, self._most, f"{self._what}s")
        if known is not None and is_older(*((known, new) if self._earliest else (new, known))):
            answers.append(self._message(key, known))
        else:
            self[key] = new
