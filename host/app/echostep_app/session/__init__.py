# SPDX-License-Identifier: MIT
"""One tracked run, from its source of bytes to its files: demo, live, record, replay.

In: options of the command line. Out: a recording, track files, views, reports to a commander. Owns the run: `Session` holds tracker, page and outlet.
"""
