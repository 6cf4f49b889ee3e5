"""Before the first walk: find the ports, flash, diagnose and calibrate a board.

In: ports. Out: findings in words, settings, a flashed board. Owns nothing after it ends.
"""
