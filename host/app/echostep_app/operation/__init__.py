# SPDX-License-Identifier: MIT
"""The commander's page: a team on one plan, in a browser.

In: messages of a broker. Out: HTML and a WebSocket of frames. Owns the operation (roster, trails, histories) and the server's thread, which never
blocks the receiver.
"""
