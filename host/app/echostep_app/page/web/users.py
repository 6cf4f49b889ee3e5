# SPDX-License-Identifier: MIT
"""Whether other people may be logged in to this computer.

In: the accounts that the system lists. Out: yes or no. Owns nothing.

Every user of a computer reaches its loopback interface. Where one person alone can log in, the page's address stays short, and fixed for a proxy;
where there are several, it has a token as on a network. Accounts that are only listed on request (LDAP) are not seen: give `--host` there.
"""

from __future__ import annotations

import os
from pathlib import Path

# Accounts of people [login.defs(5), UID_MIN and UID_MAX by default]; no shell: a service
PEOPLE = range(1000, 60_001)
NO_SHELLS = ("nologin", "false", "sync")


def has_other_users() -> bool:
    """Whether an account of another person than this process's user has a shell; where accounts cannot be listed (Windows), no."""
    try:
        import pwd
    except ImportError:
        return False
    own = os.getuid()
    return any(
        entry.pw_uid in PEOPLE and entry.pw_uid != own and Path(entry.pw_shell).name not in NO_SHELLS
        for entry in pwd.getpwall()
    )
