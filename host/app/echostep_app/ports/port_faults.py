# SPDX-License-Identifier: MIT
"""Exceptions of pyserial when a port cannot be opened, set or used."""

from __future__ import annotations

import serial

try:
    from termios import error as _terminal_error  # not an OSError; pyserial passes it on when a port goes away
except ImportError:  # Windows has no termios
    _terminal_error = OSError  # type: ignore[misc, assignment]

PORT_FAULTS = (serial.SerialException, OSError, ValueError, NotImplementedError, _terminal_error)
"""ValueError: a setting or a URL that pyserial refuses. NotImplementedError: a setting that a kind of URL lacks."""
