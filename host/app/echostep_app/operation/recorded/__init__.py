# SPDX-License-Identifier: MIT
"""An operation on file: its recording and its replay.

In: messages with their times of arrival; a file. Out: the file; the operation at any time. Owns the file that it writes.
"""
