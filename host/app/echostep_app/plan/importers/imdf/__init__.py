# SPDX-License-Identifier: MIT
"""Indoor Mapping Data Format [OGC 20-094]: archives of GeoJSON.

In: a folder or an archive. Out: a plan. Owns nothing.
"""
