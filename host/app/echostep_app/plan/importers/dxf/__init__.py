# SPDX-License-Identifier: MIT
"""Drawings (DXF): entities to lines, lines to walls, arcs to doors.

In: DXF files, one per level. Out: `Plan`. Owns nothing.
"""
