# SPDX-License-Identifier: MIT
"""What the bench asks a simulated device and wearer: the dialogue that configures an MTx or MTi, and what `calibrate` asks for.

In: requests, seeds. Out: answers, rows for the twin. Owns the state of each device.
"""
