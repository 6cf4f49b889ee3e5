# SPDX-License-Identifier: MIT
"""Importers of plans on a folder of other people's drawings, models and maps.

In: a folder. Out: one row a file. Owns nothing.
"""
