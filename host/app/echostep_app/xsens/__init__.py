# SPDX-License-Identifier: MIT
"""Setting an Xsens MT: what it is asked, what it answers, which products can be set.

In: an open port. Out: a device that sends what the tracker needs, or an EchostepError. Owns nothing.
"""
