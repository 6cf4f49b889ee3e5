# SPDX-License-Identifier: MIT
"""Simulated devices: counts, frames, serial bytes with their delays.

In: physical quantities. Out: bytes with times. Owns each device's state.
"""
