# SPDX-License-Identifier: MIT
"""The dialogue that configures an MTx or MTi.

In: answers of the device. Out: requests, and the device's identity and settings. Owns the order of the dialogue.
"""
