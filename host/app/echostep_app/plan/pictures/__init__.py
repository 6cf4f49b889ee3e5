# SPDX-License-Identifier: MIT
"""How a plan is drawn: its lines and symbols, pictures of it with names, pictures that lie on a map.

In: plans. Out: lines, files. Owns the looks.
"""
