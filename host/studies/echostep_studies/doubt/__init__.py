# SPDX-License-Identifier: MIT
"""Study: what is claimed while a sensor lies, or the trunk moves and no step is measured. Simulated.

In: seeds. Out: a row a kind: how long `tracking` was said more than a metre off. Owns nothing.
"""
