# SPDX-License-Identifier: MIT
"""README's figure that no study prints.

In: a recording. Out: the figure on the terminal, its picture. Owns nothing.
"""
