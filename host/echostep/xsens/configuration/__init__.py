# SPDX-License-Identifier: MIT
"""The dialogue that configures an MTx or MTi.

In: answers of the device. Out: requests, and what the device said of itself. Owns the order of the dialogue.
"""
