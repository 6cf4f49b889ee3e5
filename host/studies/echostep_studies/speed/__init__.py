# SPDX-License-Identifier: MIT
"""Speed as ratios against peers that do the same work.

In: nothing. Out: a table, JSON, a picture. Owns nothing.
"""
