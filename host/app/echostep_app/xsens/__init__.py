# SPDX-License-Identifier: MIT
"""Setting up an Xsens MT: requests, answers, and the products that can be set up.

In: an open port. Out: a device that sends the tracker's quantities, or an EchostepError. Owns nothing.
"""
