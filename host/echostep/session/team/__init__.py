# SPDX-License-Identifier: MIT
"""What a run exchanges with a team: teammates' reports, meetings, marks, the plan that is being drawn.

In: messages of a team. Out: chunks for the tracker, notices. Owns the connections.
"""
