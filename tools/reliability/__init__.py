# SPDX-License-Identifier: MIT
"""Campaigns that look for what fails: faults, hours, kills, flipped bits, hostile bytes, teams.

In: the real firmware in the twin, the host. Out: figures with their limits; exit status 1 when one is missed. Owns no product code; the small
version of each campaign is a test.
"""
