# SPDX-License-Identifier: MIT
"""Laser logs of robots as buildings to be tracked in.

In: CARMEN logs. Out: plans, odometry, pings, walks. Owns nothing.
"""
