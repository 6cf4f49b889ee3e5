# SPDX-License-Identifier: MIT
"""Walls drawn from a solved graph, each with its evidence and standard deviation.

In: a solved graph. Out: lines and pieces of walls. Owns nothing.
"""
