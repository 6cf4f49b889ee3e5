"""What simulated devices make of the world: counts, frames, serial bytes with their delays.

In: physical quantities. Out: bytes with times. Owns each device's state.
"""
