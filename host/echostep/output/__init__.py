"""What leaves a run, but for the browser and the team: the terminal view, track files, pictures, messages for Foxglove.

In: the tracker's published state and its estimates. Out: text, CSV, Parquet, GeoPackage, KML, PNG, MCAP messages. Owns nothing.
"""
