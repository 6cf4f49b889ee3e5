# SPDX-License-Identifier: MIT
"""Calls of the operating system that fail, one after the other, in each command that runs.

In: commands, kinds of calls. Out: what became of the run. Owns a process for each call.
"""
