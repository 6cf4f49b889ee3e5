# SPDX-License-Identifier: MIT
"""Importers of drawings and maps of other programs: one module per format, and the geometry that they share.

In: a file or folder, and hints about its units and layers. Out: `Plan`. Owns nothing. The files are untrusted: sizes and values are limited.
"""
