# SPDX-License-Identifier: MIT
"""Legs by gyros: simulated people, and public recordings of real legs.

In: seeds, or a folder of recordings. Out: rows. Owns nothing.
"""
