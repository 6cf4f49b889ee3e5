# SPDX-License-Identifier: MIT
"""The pages that are made from code and tables, and the manual as a site.

In: the installed package, firmware/hardware, the pages of the source tree. Out: pages, drawings, out/site. Owns nothing.
"""
