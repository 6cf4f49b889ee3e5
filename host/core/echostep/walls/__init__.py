# SPDX-License-Identifier: MIT
"""Tables of a plan for kernels: which walls a move crosses, and the echo sources within a ranger's cone.

In: a `Plan`. Out: `Walls` on a `LevelSheet` (all levels side by side). Owns the tables of tiles, filled when a cloud first comes near.
`index` declares the tables, `echo_sources` fills them (`tile_faces`, `tile_points`), `source_blocks` reads them.
"""
