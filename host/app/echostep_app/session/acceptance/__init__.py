# SPDX-License-Identifier: MIT
"""`echostep acceptance`: surveyed points are tapped during a live walk, and a page tells what the tracker has achieved.

In: ports, the lengths of a corridor or a plan with points; or a recording of such a walk. Out: the recording and the page.
"""
