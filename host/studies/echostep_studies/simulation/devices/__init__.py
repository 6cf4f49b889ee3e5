# SPDX-License-Identifier: MIT
"""Simulated device and wearer of the bench: the configuration dialogue of an MTx or MTi, and the movements for `calibrate`.

In: requests, seeds. Out: answers, rows for the twin. Owns the state of each device.
"""
