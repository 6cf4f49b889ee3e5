# SPDX-License-Identifier: MIT
"""A recorded walk: the recorded start, seed and settings of its run, a tracker with these, and the estimates as a table.

In: a recording, a plan. Out: a `Tracker`, a `Walk`, track.csv. Owns nothing.
"""
