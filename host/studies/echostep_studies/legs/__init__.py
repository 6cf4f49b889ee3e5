# SPDX-License-Identifier: MIT
"""Legs by gyros and feet: simulated people in every manner of moving, the walks of Lee and Lee 2010, public recordings of real legs.

In: seeds, or a folder of recordings. Out: rows. Owns nothing.
"""
