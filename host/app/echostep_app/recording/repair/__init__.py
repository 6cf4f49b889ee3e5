# SPDX-License-Identifier: MIT
"""Recordings that are damaged, cut, or joined: what they hold, and whole files made of them.

In: recordings. Out: recordings, a summary of the contents. Owns nothing.
"""
