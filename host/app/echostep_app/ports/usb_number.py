# SPDX-License-Identifier: MIT
"""USB serial numbers of ports: by them a device is found again under another name.

In: a port, the system's list of ports. Out: the number of its device, the port of a number. Opens nothing.
"""

from __future__ import annotations

import os

from serial.tools import list_ports


def usb_number(port: str) -> str:
    """The serial number of the device on a port; empty where it has none, or shares it with another one."""
    device, seen = os.path.realpath(port), list_ports.comports()
    number = next((each.serial_number or "" for each in seen if each.device == device), "")
    return number if sum(each.serial_number == number for each in seen) == 1 else ""


def port_of_number(number: str) -> str | None:
    """The port of the device with this serial number; None while it is not plugged in."""
    return next((each.device for each in list_ports.comports() if each.serial_number == number), None)
