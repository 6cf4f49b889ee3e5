"""Both ports' bytes -> the trunk's path with the pings heard on each piece of it.

In: `Portion`s of chunks. Out: `MeasuredSegment`s and `Dropout`s in order of time. Owns readers, timeline, foot and legs, and what waits
for each other.
"""
