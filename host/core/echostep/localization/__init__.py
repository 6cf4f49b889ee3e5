# SPDX-License-Identifier: MIT
"""The particle filter on the plan: path and pings -> position.

In: `MeasuredSegment`s and beacon readings. Out: `Estimate`s: position, covariance, heading, status. Owns the particles and the beacon map.

Others may import `map_filter`, `beacon_map`, `building`, `settings`, `estimate`, `belief`, and what the five sub-packages name. The floors stand in
`.importlinter`.
"""
