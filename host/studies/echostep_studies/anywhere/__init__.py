# SPDX-License-Identifier: MIT
"""Study: found from nowhere, found again, and a radius that can be trusted. Simulated walks, each tracked under many conditions.

In: seeds, and westport-house where it is at hand. Out: rows `start/...`, `kidnap/...`, `plan/...`, `echoes/...`, `hall`, `outside`. Owns nothing.
"""
