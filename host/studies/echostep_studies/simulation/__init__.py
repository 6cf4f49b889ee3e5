# SPDX-License-Identifier: MIT
"""Simulated people, air and sites that only studies use.

In: seeds. Out: motion, pressure, plans. Owns nothing. Shares no code with the estimator but the plan.
"""
