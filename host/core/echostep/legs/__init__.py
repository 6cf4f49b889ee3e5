# SPDX-License-Identifier: MIT
"""Legs from gyros on thigh and shank, heading from the belt gyro and a compass, and the trunk's path that follows from both.

In: rates of thigh, shank and belt (rad/s) and compass bearings. Out: `Stride`s, and from them `PathSegment`s of the trunk. Owns the limb
model's state.
"""
