# SPDX-License-Identifier: MIT
"""The foot on public recordings with truth.

In: a folder of recordings. Out: rows and pictures. Owns nothing.
"""
