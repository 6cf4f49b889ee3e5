# SPDX-License-Identifier: MIT
"""Floors of a recorded barometer, by the tracker's height filter.

In: a file of pressures, heights of floors. Out: a table of floors. Owns nothing.
"""
