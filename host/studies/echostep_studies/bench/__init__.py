# SPDX-License-Identifier: MIT
"""Common parts of several studies: sites and walks through them, the filter on a walk, and the evaluation of its claims.

In: seeds, recordings. Out: walks, claims, rows of runs and summary rows. Owns the definitions of found, lost
and false claims. No study imports another one.
"""
