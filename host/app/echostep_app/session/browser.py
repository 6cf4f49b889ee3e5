# SPDX-License-Identifier: MIT
"""Opens the page in a browser, if one is available.

In: a URL. Out: whether a browser was started. Owns nothing.
"""

from __future__ import annotations

import os
import sys
import webbrowser

SCREENS = ("DISPLAY", "WAYLAND_DISPLAY")  # one of them is set where windows can be shown, but for Windows and macOS


def open_browser(url: str) -> bool:
    """Start the user's browser; False on a machine without a screen, over ssh, or when none could be started."""
    has_screen = sys.platform in ("win32", "darwin") or any(os.environ.get(name) for name in SCREENS)
    if not has_screen or os.environ.get("SSH_CONNECTION"):
        return False
    try:
        return webbrowser.open(url)
    except webbrowser.Error:
        return False
