# SPDX-License-Identifier: MIT
"""What commands print: one text a command in tests/snapshots, with a paragraph for each case; `make snapshots` writes them anew.

In: the name of a command, what it printed in each case. Out: a failed test where that differs. Owns tests/snapshots/*.txt.
"""

from __future__ import annotations

import fcntl
import os
import re
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any

import pytest

from echostep.errors import EchostepError

FOLDER = Path(__file__).with_suffix("")
IS_RENEWED = "RENEW_SNAPSHOTS" in os.environ
HEAD = "== "  # of a paragraph: before the name of its case
NUMBER = re.compile(r"-?\d+(?:\.\d+)?")


def refusal(call: Callable[[], object]) -> str:
    """The one sentence with which a call is refused."""
    with pytest.raises((EchostepError, ValueError)) as caught:
        call()
    assert "\n" not in str(caught.value)
    return str(caught.value)


def expect(command: str, printed: Mapping[str, object], within: float = 0.0, **hidden: object) -> None:
    """Compare what a command printed, by case, with its text; numbers may differ by `within`, and a value in `hidden` is replaced by its name."""
    path = FOLDER / f"{command}.txt"
    found = {case: _text(one, hidden) for case, one in printed.items()}
    if IS_RENEWED:
        _renew(path, found)
    known = _paragraphs(path.read_text()) if path.exists() else {}
    for case, text in found.items():
        expected = known.get(case, "")
        assert text == expected or _is_near(text, expected, within), f"{path.name}, {case} (anew: make snapshots)"


def _text(printed: Any, hidden: Mapping[str, object]) -> str:
    """Printed lines as one text: of a command's end with its exit status."""
    if isinstance(printed, CompletedProcess):
        printed = f"exit status {printed.returncode}\n{printed.stdout}{printed.stderr}"
    elif isinstance(printed, Iterable) and not isinstance(printed, str):
        printed = "\n".join(map(str, printed))
    text = str(printed)
    for name, value in hidden.items():
        text = text.replace(str(value), name)
    return "\n".join(line.rstrip() for line in text.strip().splitlines())


def _is_near(text: str, expected: str, within: float) -> bool:
    """Whether both are the same words with numbers no further apart than `within`."""
    numbers = (map(float, NUMBER.findall(one)) for one in (text, expected))
    return NUMBER.sub("", text) == NUMBER.sub("", expected) and all(
        abs(a - b) <= within for a, b in zip(*numbers, strict=True)
    )


def _paragraphs(content: str) -> dict[str, str]:
    parts = (part.partition("\n") for part in f"\n{content}".split(f"\n{HEAD}")[1:])
    return {case: text.strip("\n") for case, _, text in parts}


def _renew(path: Path, found: Mapping[str, str]) -> None:
    """Put these paragraphs into the file, which other tests write to as well."""
    FOLDER.mkdir(exist_ok=True)
    with path.open("a+") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        file.seek(0)
        known = _paragraphs(file.read()) | dict(found)
        file.truncate(0)
        file.write("\n".join(f"{HEAD}{case}\n{text}\n" for case, text in sorted(known.items())))
