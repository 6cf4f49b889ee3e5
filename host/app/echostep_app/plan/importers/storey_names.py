# SPDX-License-Identifier: MIT
"""Storeys by the words that name them: of files, layers, blocks and levels.

In: a name. Out: the storey's number, 0 on the ground. Owns the words, in many languages.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple

# Words that name a storey without a number; 99 is the top
ALONE = {
    **dict.fromkeys(("eg", "erdgeschoss", "ground", "gf", "rdc", "rez", "pb", "pt", "terra", "baja", "begane", "parterre"), 0), "sf": 2, "tf": 3,
    **dict.fromkeys(("og", "obergeschoss", "ff"), 1), **dict.fromkeys(("dg", "dachgeschoss", "attic", "combles"), 99),
}  # fmt: skip
# Words that need a number beside them; those below are the first one without it
ABOVE = {
    "og", "obergeschoss", "stock", "geschoss", "etage", "étage", "niveau", "niv", "floor", "storey", "story", "level", "lvl", "ebene", "piso",
    "planta", "piano", "verdieping",
}  # fmt: skip
BELOW = {
    "kg",
    "ug",
    "keller",
    "kellergeschoss",
    "untergeschoss",
    "basement",
    "souterrain",
    "sous",
    "sótano",
    "sotano",
    "interrato",
}
CODES = {
    **dict.fromkeys("lpefn", 1),
    **dict.fromkeys("bus", -1),
}  # letters before a number without a space, as L1, P2, B1
MOST_CODED, MOST, LONGEST = 20, 99, 4  # storeys; greater numbers are measures; letters of a number
SPELT = {"first": "1", "second": "2", "third": "3", "fourth": "4", "premier": "1", "primer": "1", "primo": "1"}
BESIDE = {"st", "nd", "rd", "th", "er", "ème", "eme", "º", "ª", "sol"}  # between a number and its word
TOKEN = re.compile(r"(?<![^\W_])r[+-]\d{1,2}(?!\d)|(?:(?<=\s)|^)-\d+|\d+|[^\W\d_]+")
Token = tuple[str, int, int]  # a word or a number, where it begins and ends


class StoreyName(NamedTuple):
    """The number of a storey, and the words that name it."""

    number: int
    words: str


def storey_of(name: str) -> StoreyName | None:
    """The storey that a name names; None where it names none, or several."""
    found = [
        (SPELT.get(token[0], token[0]), *token.span())
        for token in TOKEN.finditer(name.casefold().replace("\u2212", "-"))
    ]
    tokens = [token for token in found if token[0] not in BESIDE]
    storeys: dict[int, str] = {}
    for k in range(len(tokens)):
        if (named := _named(tokens, k)) is not None:
            number, used = named
            storeys.setdefault(number, name[min(t[1] for t in used) : max(t[2] for t in used)])
    return StoreyName(*storeys.popitem()) if len(storeys) == 1 else None


def _named(tokens: list[Token], k: int) -> tuple[int, list[Token]] | None:
    """The storey that a word names with the number beside it, and these tokens."""
    word, begin, end = own = tokens[k]
    if re.match(r"r[+-]", word):
        return int(word[1:]), [own]
    before, behind = (tokens[i] if 0 <= i < len(tokens) and _is_number(tokens[i][0]) else None for i in (k - 1, k + 1))
    if word in CODES:
        is_code = behind is not None and behind[1] == end and int(behind[0]) <= MOST_CODED
        return (CODES[word] * int(behind[0]), [own, behind]) if is_code and behind else None
    if word in ABOVE | BELOW:
        near = before is not None and begin - before[2] < 3 and (behind is None or behind[1] > end)
        number = before if near else behind or before
        if number is not None:
            return (-abs(int(number[0])) if word in BELOW else int(number[0])), [own, number]
    usual = -1 if word in BELOW else ALONE.get(word)
    return None if usual is None else (usual, [own])


def _is_number(text: str) -> bool:
    return len(text) <= LONGEST and text.lstrip("-").isdecimal() and abs(int(text)) <= MOST


def in_order(names: Sequence[str]) -> list[str]:
    """The storeys' names from the lowest; unchanged where one does not name its storey."""
    storeys = [storey_of(name) for name in names]
    known = [(storey.number, k) for k, storey in enumerate(storeys) if storey is not None]
    return [names[k] for _, k in sorted(known)] if len(known) == len(names) else list(names)
