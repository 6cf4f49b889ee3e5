# SPDX-License-Identifier: MIT
"""Messages among the members of a team: reports, marks, drawn plans; meetings and beacons are chunks too (`ports/people`).

In: JSON of other programs. Out: validated messages, and back. Owns their schemas.
"""
