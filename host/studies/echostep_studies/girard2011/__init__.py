# SPDX-License-Identifier: MIT
"""The 52 steps of Girard et al. 2011, and the same walk with other parts.

In: seeds. Out: rows, a picture. Owns nothing.
"""
