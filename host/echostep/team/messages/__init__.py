# SPDX-License-Identifier: MIT
"""What the members of a team tell each other: reports, marks, meetings, beacons, drawn plans.

In: JSON of other programs. Out: validated messages, and back. Owns their schemas.
"""
