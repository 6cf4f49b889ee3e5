# SPDX-License-Identifier: MIT
"""Spaces of a plan, leaks in walls, positions where a person can stand, and the space around a position.

In: a plan. Out: spaces, places, findings. Owns nothing.
"""
