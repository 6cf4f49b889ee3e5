"""Drawings (DXF): entities to lines, lines to walls, arcs to doors.

In: a DXF file. Out: `Plan`. Owns nothing.
"""
