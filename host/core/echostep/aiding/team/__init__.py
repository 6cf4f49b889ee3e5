# SPDX-License-Identifier: MIT
"""Information from teammates: meetings, and beacons that they have placed.

In: `Meeting`s, messages of teammates. Out: the same clouds, reweighted (others may import `meetings`, `shared_beacons`). Owns when each teammate was
met, and the newest message of each.
"""
