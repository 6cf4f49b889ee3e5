# SPDX-License-Identifier: MIT
"""The graph of a walk without a plan: nodes along the path, fragments of walls seen from them, returns to the same passage.

In: segments and pings. Out: a solved graph. Owns its nodes, edges and fragments.
"""
