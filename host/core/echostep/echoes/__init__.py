# SPDX-License-Identifier: MIT
"""How likely an echo is: by the plan, without a plan, and by a table for a cloud that is spread over the building.

In: a ranger's echoes, walls. Out: densities, and particles reweighted by them. Owns the views of both
rangers, and the odds of a missed echo.
"""
