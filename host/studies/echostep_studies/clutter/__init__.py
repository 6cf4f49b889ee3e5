# SPDX-License-Identifier: MIT
"""Study: real clutter. Laser scans of real buildings become pings, a plan drawn from the other scans, and a path by the robot's odometry.

In: a folder of CARMEN logs. Out: rows `NAME/full/...` and `NAME/walls/...`. Owns nothing. The buildings are real, the echoes of the rangers
are simulated.
"""
