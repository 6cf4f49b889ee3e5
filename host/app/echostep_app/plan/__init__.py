# SPDX-License-Identifier: MIT
"""Plans beyond plan.json: importers of other formats, checks, pictures, routes, and positions in words.

In: plan files of any format, a `Plan`. Out: `Plan`s, findings, drawings, routes. Owns nothing.
"""
