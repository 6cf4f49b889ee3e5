# SPDX-License-Identifier: MIT
"""What the page shows, one element a module.

In: the tracker's published state. Out: plain data for `page.protocol`. Owns nothing that the tracker reads.
"""
