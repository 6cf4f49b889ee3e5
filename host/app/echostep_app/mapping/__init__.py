# SPDX-License-Identifier: MIT
"""Mapping: a walk's path and echoes -> the corrected path, and the walls as a plan.

In: `MeasuredSegment`s. Out: `Drawing`, `Plan`. Owns nothing that the tracker uses.
"""
