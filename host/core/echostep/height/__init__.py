# SPDX-License-Identifier: MIT
"""Heights: of particles on their levels, of a ride in a lift, above the start without a plan.

In: rises of the foot, heights by air pressure. Out: heights, levels, log-weights. Owns two Kalman filters.
"""
