# SPDX-License-Identifier: MIT
"""The wearer: whether they fell, cannot move or call for help.

In: samples of gyros and accelerometers, segments of the path, taps. Out: the present `Alarm`. Owns the windows with or without motion, the
detection of falls, and the times since which each sign lasts.
"""
