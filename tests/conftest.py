"""Property tests draw the same examples everywhere and know no deadline, for the first one may compile a kernel."""

from hypothesis import settings

settings.register_profile("repeatable", deadline=None, derandomize=True)
settings.load_profile("repeatable")
