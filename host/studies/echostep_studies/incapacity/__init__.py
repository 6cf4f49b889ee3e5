# SPDX-License-Identifier: MIT
"""Delay of the alarm for an incapacitated wearer, and rate of false alarms.

In: seeds, public recordings. Out: rows. Owns nothing.
"""
