# SPDX-License-Identifier: MIT
"""Models of a wearer's own two rangers, fitted to the pings of a recorded walk on a plan.

In: a recording, its plan. Out: settings, and faults of a ranger. Owns nothing.
"""
