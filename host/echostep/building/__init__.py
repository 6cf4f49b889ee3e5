"""Plans that people have -> `echostep.plan.Plan`: one module a format, and the geometry that they share.

In: files of other programs. Out: a `Plan`. Nothing here is needed to track.
"""
