# SPDX-License-Identifier: MIT
"""What a wearer's own two rangers do: fitted to the pings of a recorded walk on a plan.

In: a recording, its plan. Out: settings, and what is wrong with a ranger. Owns nothing.
"""
