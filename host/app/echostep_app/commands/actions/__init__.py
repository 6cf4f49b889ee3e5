# SPDX-License-Identifier: MIT
"""What commands do that track nothing live; the commands themselves are declared beside this folder.

In: options of a command. Out: files, tables, an error in one line. Owns nothing.
"""
