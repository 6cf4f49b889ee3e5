# SPDX-License-Identifier: MIT
"""Commands that are not a tracked run: offline files, floors, plans, recordings, beacons, studies.

In: options of the command line. Out: files and text. Owns nothing. Each module is imported when its command runs.
"""
