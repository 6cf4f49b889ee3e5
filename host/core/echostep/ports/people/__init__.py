# SPDX-License-Identifier: MIT
"""Chunks of bytes that persons and teammates send: check-ins, meetings, beacons of a team.

In: bytes. Out: validated messages, and back. Owns nothing.
"""
