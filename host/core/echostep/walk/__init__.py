# SPDX-License-Identifier: MIT
"""A recorded walk: what its recording says of the run, the tracker that this asks for, and the estimates as a table.

In: a recording, a plan. Out: a `Tracker`, a `Walk`, track.csv. Owns nothing.
"""
