# SPDX-License-Identifier: MIT
"""Weighted particles as plain arrays: propagation, resampling, ellipses of covariances, limits of the claims.

In: arrays of particles, moves, walls. Out: the same arrays, changed. Owns nothing.
"""
