# SPDX-License-Identifier: MIT
"""The browser: the live page, the replay page and the plan editor.

In: the tracker's published state. Out: HTML and a WebSocket of frames; check-ins of the wearer. Owns the server and its thread, which
never block the tracker.
"""
