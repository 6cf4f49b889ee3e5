# SPDX-License-Identifier: MIT
"""Estimates -> spoken and drawn cues on the way to a destination.

In: estimates, a destination. Out: `Cue`s, one at a time. Owns the present cue and the route.
"""
