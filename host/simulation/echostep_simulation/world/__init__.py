# SPDX-License-Identifier: MIT
"""The simulated world: echoes, air pressure, magnetic field, buildings.

In: positions and attitudes. Out: times of flight, pressures, fields. Owns nothing.
"""
