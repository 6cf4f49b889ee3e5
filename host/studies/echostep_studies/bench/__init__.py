# SPDX-License-Identifier: MIT
"""What several studies share: sites and walks through them, the filter on a walk, and what its claims are worth.

In: seeds, recordings. Out: walks, claims, rows of runs and summary rows. Owns the definitions of found, lost and false. No study imports another one.
"""
