# SPDX-License-Identifier: MIT
"""The frame of every study: runs, rows, tables, files, pictures.

In: a function of one seed that returns rows, or recordings. Out: tables and files. Owns the journal of the runs.
"""
