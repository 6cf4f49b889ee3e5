# SPDX-License-Identifier: MIT
"""Takes from our packages what only POSIX systems have; Python imports this file at its start when its folder is on PYTHONPATH.

In: nothing. Out: for code of `echostep` alone, `os`, `signal`, `time`, `socket`, `select`, `sys` as on Windows, and no `fcntl` or `termios`.
Other packages see the system as it is: they have versions of their own for Windows. It is no Windows: files are opened, renamed and locked as here.
"""

from __future__ import annotations

import builtins
import os
import select
import signal
import socket
import sys
import time
from types import FrameType, ModuleType
from typing import Any

PACKAGES = ("echostep", "echostep_app")
MISSING_MODULES = {"curses", "fcntl", "grp", "posix", "pty", "pwd", "readline", "resource", "syslog", "termios", "tty"}
# In Python's documentation these have the note "Availability: Unix" [docs.python.org/3.11].
MISSING_NAMES = {
    "os": """chown chroot fchdir fchmod fchown fork forkpty getegid geteuid getgid getgroups getloadavg getpgid getpgrp getpriority getresuid getsid
        getuid killpg lchown lockf mkfifo mknod nice openpty pathconf pidfd_open pipe2 posix_fadvise posix_fallocate posix_spawn pread preadv pwrite
        pwritev readv register_at_fork sched_getaffinity sched_setaffinity sched_yield sendfile set_blocking get_blocking setpgid setpriority setsid
        setuid statvfs fstatvfs sync fdatasync sysconf tcgetpgrp ttyname uname wait wait3 wait4 writev O_CLOEXEC O_DIRECTORY O_DSYNC O_NOCTTY
        O_NOFOLLOW O_NONBLOCK O_SYNC WNOHANG getxattr setxattr memfd_create eventfd""",
    "signal": """SIGALRM SIGBUS SIGCHLD SIGCONT SIGHUP SIGIO SIGKILL SIGPIPE SIGPROF SIGPWR SIGQUIT SIGSTOP SIGTSTP SIGTTIN SIGTTOU SIGURG SIGUSR1
        SIGUSR2 SIGVTALRM SIGWINCH SIGXCPU alarm pause pthread_kill pthread_sigmask setitimer getitimer siginterrupt sigpending sigtimedwait
        sigwait sigwaitinfo""",
    "time": """CLOCK_BOOTTIME CLOCK_MONOTONIC CLOCK_MONOTONIC_RAW CLOCK_PROCESS_CPUTIME_ID CLOCK_REALTIME CLOCK_TAI CLOCK_THREAD_CPUTIME_ID
        clock_getres clock_gettime clock_gettime_ns clock_settime pthread_getcpuclockid tzset""",
    "socket": "AF_UNIX SO_REUSEPORT socketpair_unix sethostname send_fds recv_fds CMSG_LEN SCM_RIGHTS AF_NETLINK AF_PACKET",
    "select": "poll epoll devpoll kqueue kevent",
    "sys": "abiflags getdlopenflags setdlopenflags",
}
OTHER_VALUES: dict[tuple[str, str], Any] = {("os", "name"): "nt", ("sys", "platform"): "win32"}
_HIDDEN = {module: frozenset(names.split()) for module, names in MISSING_NAMES.items()}
_import, _select = builtins.__import__, select.select


def sockets_only(*waited: Any) -> Any:
    """`select.select`, which on Windows takes sockets alone."""
    for each in (*waited[0], *waited[1], *waited[2]):
        if not isinstance(each, socket.socket):
            raise OSError(10038, "an operation was attempted on something that is not a socket")
    return _select(*waited)


OTHER_VALUES["select", "select"] = sockets_only


def is_ours(frame: FrameType) -> bool:
    """Whether a frame runs code of the package."""
    return str(frame.f_globals.get("__name__", "")).partition(".")[0] in PACKAGES


class AsOnWindows(ModuleType):
    """A module that lacks names for the package, and has other values for it."""

    def __new__(cls, *named: Any) -> Any:
        """A plain one: Python makes new modules as `type(sys)`."""
        return ModuleType(*named)

    def __getattribute__(self, name: str) -> Any:
        module = _MODULES[id(self)]
        if name in _HIDDEN[module] or (module, name) in OTHER_VALUES:
            frame = sys._getframe(1)
            if is_ours(frame) and name in _HIDDEN[module]:
                raise AttributeError(f"module '{module}' has no attribute '{name}'")
            if is_ours(frame):
                return OTHER_VALUES[module, name]
        return super().__getattribute__(name)


def import_as_on_windows(name: str, globals: Any = None, *rest: Any, **more: Any) -> Any:  # noqa: A002 (the name of __import__'s argument)
    """`__import__` without the modules that are missing."""
    importer = str((globals or {}).get("__name__", "")).partition(".")[0]
    if importer in PACKAGES and name.partition(".")[0] in MISSING_MODULES:
        raise ModuleNotFoundError(f"No module named '{name}'", name=name)
    return _import(name, globals, *rest, **more)


_MODULES = {id(module): module.__name__ for module in (os, signal, time, socket, select, sys)}
for changed in (os, signal, time, socket, select, sys):
    changed.__class__ = AsOnWindows
builtins.__import__ = import_as_on_windows
