"""Simple Indoor Tagging of OpenStreetMap (.osm).

In: an OSM file. Out: `Plan`. Owns nothing.
"""
