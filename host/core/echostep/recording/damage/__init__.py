# SPDX-License-Identifier: MIT
"""Damage of a recording's file: the state of its end, offsets of valid records, messages in their original place.

In: the bytes of a file. Out: offsets, checksums, order. Owns nothing.
"""
