# SPDX-License-Identifier: MIT
"""Exchange of a run with its team: teammates' reports, meetings, marks.

In: messages of a team. Out: chunks for the tracker, notices. Owns the connections.
"""
