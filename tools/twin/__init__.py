# SPDX-License-Identifier: GPL-3.0-or-later
"""The real firmware on a simulated board: the program's sources by kind (bench, mcu, parts, usb), and what plays and measures it.

In: firmware/build/echostep.elf. Out: build/echostep-twin, pseudo terminals, figures. Owns nothing.
"""
