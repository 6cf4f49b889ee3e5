# SPDX-License-Identifier: MIT
"""Another user of this computer, for processes that a test starts as root.

In: nothing. Out: the beginning of a command. Owns nothing. The user may read every file, as an installation for all is read, for the Python of a
checkout may lie in root's home; it writes what its number may write.
"""

from __future__ import annotations

import os
import shutil

import pytest

ANOTHER_USER = 1234  # a number that no account of a computer need have
AS_ANOTHER_USER = (
    *("setpriv", f"--reuid={ANOTHER_USER}", f"--regid={ANOTHER_USER}", "--clear-groups"),
    *("--inh-caps=+dac_read_search", "--ambient-caps=+dac_read_search"),
)
needs_another_user = pytest.mark.skipif(
    os.geteuid() != 0 or shutil.which("setpriv") is None,
    reason="only root can be another user for the length of a test",
)
