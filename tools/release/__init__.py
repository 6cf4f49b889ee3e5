# SPDX-License-Identifier: MIT
"""Checks before a release: equal results, the wheel in an empty environment, versions, licences.

In: the checkout. Out: lists and tables on stdout, host/tested-versions.txt. Owns that file.
"""
