# SPDX-License-Identifier: MIT
"""What is checked before something is given out: equal results, the wheel in an empty environment, versions, licences.

In: the checkout. Out: lists and tables on stdout, host/tested-versions.txt. Owns that file.
"""
