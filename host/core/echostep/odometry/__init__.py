# SPDX-License-Identifier: MIT
"""Odometry: bytes of board and MTx -> the trunk's path with the pings triggered on each segment.

In: `Portion`s of chunks. Out: `MeasuredSegment`s and `Dropout`s in order of time; the samples that the signs of the wearer are taken from.
Owns the readers, the timeline, the foot and leg odometry, and the pings and segments that wait for each other.
"""
