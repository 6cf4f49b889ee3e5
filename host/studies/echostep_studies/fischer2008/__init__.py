# SPDX-License-Identifier: MIT
"""The guided returns of Fischer et al. 2008.

In: seeds. Out: rows and pictures. Owns nothing. Everything is simulated.
"""
