# SPDX-License-Identifier: MIT
"""Output of a run, except to the browser and to the team: terminal view, track files, pictures, derived messages.

In: the tracker's published state and its estimates. Out: text, CSV, Parquet, GeoPackage, KML, PNG, MCAP messages. Owns nothing.
"""
