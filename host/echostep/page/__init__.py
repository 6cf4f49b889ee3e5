"""The live page: what the tracker knows, in every browser that looks.

`server.py` serves it from a thread of its own, `scene.py` says what it shows, `session.py` speaks with one page, `static/` is the page itself.
"""
