# SPDX-License-Identifier: MIT
"""Study: global localization, recovery after a kidnap, and calibration of the protection radius. Simulated walks, each tracked under many conditions.

In: seeds, and westport-house where it is at hand. Out: rows `start/...`, `kidnap/...`, `plan/...`, `echoes/...`, `hall`, `outside`. Owns nothing.
"""
