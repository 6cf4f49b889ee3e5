# SPDX-License-Identifier: MIT
"""Faults of a board, from its own reports: parts, restarts, supply, rates.

In: messages of the board. Out: `Finding`s, each with a remedy. Owns the texts.
"""
