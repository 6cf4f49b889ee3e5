"""Tests may import the tools; property tests draw the same examples everywhere and know no deadline, for the first one may compile a kernel."""

import sys
from pathlib import Path

from hypothesis import settings

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tools"))

settings.register_profile("repeatable", deadline=None, derandomize=True)
settings.load_profile("repeatable")
