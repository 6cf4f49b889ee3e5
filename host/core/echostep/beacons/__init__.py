# SPDX-License-Identifier: MIT
"""Beacons dropped on the way: each particle estimates their places, and their readings reweight the cloud [Montemerlo 2002, FastSLAM].

In: readings of beacons. Out: log-weights, places. Owns each particle's estimate of each beacon, and each beacon's health.
"""
