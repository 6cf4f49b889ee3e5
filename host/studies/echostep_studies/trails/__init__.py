# SPDX-License-Identifier: MIT
"""The trails of Fischer et al. 2008, walked by simulated people.

In: seeds. Out: rows. Owns nothing.
"""
