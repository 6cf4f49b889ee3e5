# SPDX-License-Identifier: MIT
"""Who may reach a page, and how it is served: tokens, numbers of connections, a server that starts when its socket is bound.

In: requests of browsers. Out: served or refused, with a reason. Owns the counts of connections and the lines of the log.
"""
