# SPDX-License-Identifier: MIT
"""What is wrong with a board, from its own reports: parts, restarts, supply, rates.

In: messages of the board. Out: `Finding`s, each with a remedy. Owns the texts.
"""
