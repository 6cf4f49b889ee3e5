# SPDX-License-Identifier: MIT
"""OpenStreetMap with Simple Indoor Tagging: elements, level tags, and the building made of them.

In: an OSM file. Out: `Plan`. Owns nothing.
"""
