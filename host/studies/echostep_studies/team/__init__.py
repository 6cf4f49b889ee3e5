# SPDX-License-Identifier: MIT
"""Study: a team that corrects itself. Five simulated wearers on one plan, one of them at a wrong start, each alone and with meetings.

In: seeds. Out: rows `alone` beside `together`. Owns nothing.
"""
