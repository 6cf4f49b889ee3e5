# SPDX-License-Identifier: MIT
"""Whether a wearer has fallen or cannot move: stillness, falls, the alarm.

In: samples of the gyros and accelerometers. Out: `AlarmState`. Owns the times since which each sign lasts.
"""
