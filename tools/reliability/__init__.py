# SPDX-License-Identifier: MIT
"""Reliability campaigns: faults, a working day, kills, hostile bytes.

In: the real firmware in the twin, the host. Out: figures with their limits; exit status 1 when one is missed. Owns no product code; the small
version of each campaign is a test.
"""
