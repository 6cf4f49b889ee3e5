# SPDX-License-Identifier: MIT
"""The error that ends a command with one line for the user."""


class EchostepError(Exception):
    """A wrong file, port, option, setting or firmware; its text is one line that says what is wrong and what to do (exit status 2)."""
