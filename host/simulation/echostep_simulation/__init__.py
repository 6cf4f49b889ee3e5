# SPDX-License-Identifier: MIT
"""Simulated people, world and devices, down to the bytes on each port.

In: a plan and a seed. Out: chunks of bytes, and the truth. Owns its random numbers. Shares no code with the estimator but the plan and the
wire formats.
"""
