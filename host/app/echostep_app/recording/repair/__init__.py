# SPDX-License-Identifier: MIT
"""Recordings that are damaged, cut, or joined: their contents, and whole files made of them.

In: recordings. Out: recordings, a summary of the contents. Owns nothing.
"""
