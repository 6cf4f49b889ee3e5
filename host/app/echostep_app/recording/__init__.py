# SPDX-License-Identifier: MIT
"""Recordings as they are written, described, cut and repaired; `echostep.recording` reads them.

In: chunks, or a file. Out: a file. Owns the file while it is written.
"""
