# SPDX-License-Identifier: MIT
"""Scores of tracks against the truth, by published definitions: ISO/IEC 18305 and the EvAAL framework.

In: CSV files of any tracker, a plan. Out: a `Scorecard` a track. Owns the definitions of the metrics; the studies' statistics come from here too.
"""
