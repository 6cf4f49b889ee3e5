# SPDX-License-Identifier: MIT
"""Echoes of simulated rangers, and how well the echo likelihood predicts them.

In: simulated pings. Out: rows. Owns nothing.
"""
