# SPDX-License-Identifier: MIT
"""Air pressure -> heights and floors, without a plan.

In: pressures (Pa), heights of the floors or none. Out: heights (m), floors with probabilities. Owns the vertical Kalman filters.
"""
