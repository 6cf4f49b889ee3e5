"""The wire of the sensor board and of a beacon gateway.

In: bytes. Out: messages (named tuples and numpy rows), counts converted to SI, and what is wrong with the board in words. Owns unfinished frames.
`messages` is generated from protocol/messages.toml.
"""
