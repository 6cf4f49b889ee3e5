# SPDX-License-Identifier: MIT
"""Maps made of pixels: the occupancy grids of ROS, traced into walls.

In: map.yaml and its picture. Out: a plan. Owns nothing.
"""
