# SPDX-License-Identifier: MIT
"""The commands: their arguments and options (`options`, and each module with an `app`), and what those do that are not a tracked run.

In: options of the command line. Out: files and text. Owns nothing. Slow imports wait until a command runs.
"""
