# SPDX-License-Identifier: MIT
"""Limits of probable, sure and near, in one place for the whole filter.

In: nothing. Out: limits of probability and of distance. Owns nothing. All are assumed: they say how careful the claims are, not how anything behaves.
"""

PROBABLE = 0.5  # probability of anything likelier than its contrary
SURE = 0.95  # probability of a claim: an error below TRACKING_M, a plan
BELIEVED = 0.99  # probability of anything that other things are built on: the cloud that places beacons, the level
TRACKING_M, LOST_M = 1.0, 5.0  # errors that matter: a door, a room
ROOM_M = 2.5  # particles this near to the middle of a cloud are in one place: a room
HALF_STOREY_M = 1.5  # difference of height within one level; an entrance over a few steps is on the ground
THREE_SD2 = 9.0  # squared normalised innovation of an outlier: three standard deviations
RISK = 1e-3  # probability of an error beyond the protection radius
WALKER_M_S = 1.5  # speed at which an unobserved position spreads: a brisk walk
