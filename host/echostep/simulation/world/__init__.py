"""What a simulated walker's sensors meet: echoes, air, magnetic field, buildings.

In: positions and attitudes. Out: times of flight, pressures, fields. Owns nothing.
"""
