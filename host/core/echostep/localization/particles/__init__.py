# SPDX-License-Identifier: MIT
"""The cloud: weighted particles on the plan, drawn from a start, moved, reweighted, resampled.

In: moves of the trunk in the walk frame with the pings on them, changes of height. Out: `Cloud` (others may import `cloud`, `places`, `start`).
Owns the particles; draws from the generator that it is given.
"""
