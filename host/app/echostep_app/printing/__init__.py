# SPDX-License-Identifier: MIT
"""The one place that writes to people: standard output and standard error of a command.

In: texts. Out: the same on the terminal, in a pipe or a log, for as long as that takes them. Owns both streams while a command runs.
"""
