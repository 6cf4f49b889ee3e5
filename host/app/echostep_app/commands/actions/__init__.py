# SPDX-License-Identifier: MIT
"""The work of commands that track nothing live; the parent folder declares the commands.

In: options of a command. Out: files, tables, an error in one line. Owns nothing.
"""
