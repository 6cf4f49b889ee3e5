# SPDX-License-Identifier: MIT
"""What simulated rangers hear, and how well the echo likelihood expects it.

In: simulated pings. Out: rows and pictures. Owns nothing.
"""
