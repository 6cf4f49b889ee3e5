# SPDX-License-Identifier: MIT
"""Access to a page and its server: tokens, limits on connections, a server that starts when its socket is bound.

In: requests of browsers. Out: served or refused, with a reason. Owns the counts of connections and the lines of the log.
"""
