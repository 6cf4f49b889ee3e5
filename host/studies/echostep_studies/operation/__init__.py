# SPDX-License-Identifier: MIT
"""An operation as ISO/IEC 18305 describes tests: twenty minutes on three storeys in every manner of moving, with a change of the battery.

In: a seed. Out: scorecards of simulated walks. Owns the manners of moving and the figures.
"""
