# SPDX-License-Identifier: MIT
"""The study `simple`: known starts in the simplest buildings, with the small faults of a first day.

In: seeds. Out: a row for each building and each fault: how long it tracks, how far it is off, what is claimed falsely.
"""
