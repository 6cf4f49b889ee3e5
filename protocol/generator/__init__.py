# SPDX-License-Identifier: MIT
"""The generator's parts, one per language of its output.

In: `messages.toml`. Out: the text of each generated file, for `generate.py`. Owns nothing; `schema` is the only part that the others import.
"""
