# SPDX-License-Identifier: MIT
"""Experiments of the papers and of this project: a folder per study. Nothing that a wearer installs imports it.

In: seeds, or recordings. Out: rows, a table, JSON, Parquet, pictures. Owns a journal to resume from.
"""
