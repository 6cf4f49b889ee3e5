"""What kernels look up about a plan: which walls a move crosses, and what a ranger can hear from a place.

In: a `Plan`. Out: `Walls` on a `LevelSheet` (all levels side by side). Owns the tables of tiles, filled when a cloud first comes near.
`index` declares the tables that `visibility` computes and `echo_sources` reads: read them in this order.
"""
