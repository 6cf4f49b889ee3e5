# SPDX-License-Identifier: MIT
"""Damage of a recording's file: what its end shows, where records are valid, and which messages stand where they were written.

In: the bytes of a file. Out: offsets, checksums, order. Owns nothing.
"""
