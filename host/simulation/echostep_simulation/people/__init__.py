# SPDX-License-Identifier: MIT
"""Simulated walkers: where trunk, feet and legs are.

In: waypoints, a person, a seed. Out: positions, attitudes and rates at 1 kHz. Owns nothing.
"""
