# SPDX-License-Identifier: MIT
"""The errors that end a command with one line for the user.

In: nothing. Out: `EchostepError`, `IncompleteError`; any error in words. Owns nothing.
"""


class EchostepError(Exception):
    """A wrong file, port, option, setting or firmware; its text is one line that says what is wrong and what to do (exit status 2)."""


class IncompleteError(EchostepError):
    """A run has done its work to the end, but what it has recorded lacks something (exit status 1)."""


def words_of(error: BaseException) -> str:
    """The error as a command that it ends prints it, and as the page of a run shows it."""
    if isinstance(error, OSError):
        return f"{error.filename or 'a file'}: {error.strerror or error}"
    return str(error) if isinstance(error, EchostepError) else f"{type(error).__name__}: {error}"
