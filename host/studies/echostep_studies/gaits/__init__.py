# SPDX-License-Identifier: MIT
"""Manners of moving beside walking, by the foot and by the legs.

In: seeds. Out: rows. Owns nothing.
"""
