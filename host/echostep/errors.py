"""The one error that people see: a line that names what is wrong and what to do."""


class EchostepError(Exception):
    """A wrong file, port, setting or firmware; its text is one line for the user (exit status 2)."""
