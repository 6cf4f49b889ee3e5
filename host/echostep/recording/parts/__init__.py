# SPDX-License-Identifier: MIT
"""Recordings of one run in several files: written one after the other, replayed as one.

In: chunks, or files. Out: files, or portions of chunks. Owns the file that is written.
"""
