# SPDX-License-Identifier: MIT
"""Floors by pressure alone, and walks through all floors of a building.

In: seeds, plans. Out: rows. Owns nothing.
"""
