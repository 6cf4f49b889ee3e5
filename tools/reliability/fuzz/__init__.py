# SPDX-License-Identifier: MIT
"""Mutated bytes on every way in: the firmware's codec, the host's readers, the MTx decoder.

In: kept inputs, the number of the run. Out: executions so far; exit status 1 and the input when one is a fault. Owns the kept inputs.
"""
