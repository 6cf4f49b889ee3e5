# SPDX-License-Identifier: MIT
"""Spaces of a plan: which there are, where walls leak, where someone can stand, in which one a place lies.

In: a plan. Out: spaces, places, findings. Owns nothing.
"""
