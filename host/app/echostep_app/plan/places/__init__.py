# SPDX-License-Identifier: MIT
"""Spaces of a plan: which there are, where walls leak, where a person can stand, and the space of a place.

In: a plan. Out: spaces, places, findings. Owns nothing.
"""
