# SPDX-License-Identifier: MIT
"""The kinds of run: live, replay, demo.

In: options of a command. Out: a `Session` that has run. Owns the ports and files of the run.
"""
