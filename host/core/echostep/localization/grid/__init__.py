# SPDX-License-Identifier: MIT
"""The search of the building: exact Bayes on a grid of places and headings.

In: a start, moves with their pings and changes of height. Out: poses drawn from the grid. Owns its probabilities.
"""
