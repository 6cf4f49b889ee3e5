# SPDX-License-Identifier: MIT
"""An operation on file: what is recorded of it, its past on the page, and its replay.

In: messages with their times of arrival. Out: a tape, frames of the past. Owns the file that it writes.
"""
