# SPDX-License-Identifier: MIT
"""Recordings: all received chunks in an MCAP file, written, read, described, cut and repaired.

In: chunks, or a file. Out: a file, or portions of chunks. Owns the file while it is written.
"""
