# SPDX-License-Identifier: MIT
"""Elements of the page, one a module.

In: the tracker's published state. Out: plain data for `page.protocol`. Owns nothing that the tracker reads.
"""
