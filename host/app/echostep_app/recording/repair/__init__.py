# SPDX-License-Identifier: MIT
"""Damaged, cut and joined recordings: their contents, and whole files made from the contents.

In: recordings. Out: recordings, a summary of the contents. Owns nothing.
"""
