"""Plans that people have -> plan.json: one module a format, and the geometry that they share.

In: a file or folder of another program, and hints about its unit and layers. Out: `Plan`. Owns nothing; every byte read here is hostile.
"""
