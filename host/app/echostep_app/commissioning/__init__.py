# SPDX-License-Identifier: MIT
"""Before the first walk: find the ports, flash, diagnose and calibrate a board.

In: ports. Out: findings with remedies, settings, a flashed board. Owns the ports while a command runs.
"""
