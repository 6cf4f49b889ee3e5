# SPDX-License-Identifier: MIT
"""Recorded CSV files of a foot IMU, leg gyros or a barometer, checked and tracked without a plan.

In: CSV files. Out: samples in SI with notes on irregularities, tracks as CSV. Owns nothing.
"""
