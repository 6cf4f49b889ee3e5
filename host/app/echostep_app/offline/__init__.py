# SPDX-License-Identifier: MIT
"""Recorded leg gyros as CSV files of any program; `echostep.offline` reads a foot's.

In: CSV files. Out: tracks, strides, and sentences about them. Owns nothing.
"""
