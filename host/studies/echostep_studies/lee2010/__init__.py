# SPDX-License-Identifier: MIT
"""The lap, the floors and the 3D track of Lee and Lee 2010.

In: seeds. Out: rows. Owns nothing. Everything is simulated.
"""
