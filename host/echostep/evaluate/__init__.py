# SPDX-License-Identifier: MIT
"""Experiments of the papers and of this project: one module or folder per study; `study`, `runs` and `report` are their common frame.

In: seeds, or recordings. Out: rows, a table, JSON, Parquet, pictures. Owns a journal to resume from.
"""
