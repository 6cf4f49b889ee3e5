# SPDX-License-Identifier: MIT
"""Protocol of the sensor board and of a beacon gateway.

In: bytes. Out: messages (named tuples and numpy rows), samples in SI units, and findings on the board's health as text. Owns unfinished frames.
`messages` is generated from protocol/messages.toml.
"""
