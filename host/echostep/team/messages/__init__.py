# SPDX-License-Identifier: MIT
"""Messages among the members of a team: reports, marks, meetings, beacons, drawn plans.

In: JSON of other programs. Out: validated messages, and back. Owns their schemas.
"""
