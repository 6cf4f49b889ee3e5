# SPDX-License-Identifier: MIT
"""Reports over a Meshtastic mesh, within its air time.

In: reports of a wearer. Out: packets of the mesh, and back. Owns the connection to the radio.
"""
