# SPDX-License-Identifier: MIT
"""The study `noplan`: buildings drawn from a walk alone, against the true walls and path.

In: seeds, public recordings. Out: rows, tables, pictures. Owns the sites and the judgement. The mapper sees segments only.
"""
