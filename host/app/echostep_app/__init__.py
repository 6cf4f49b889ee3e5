# SPDX-License-Identifier: MIT
"""Everything around the tracker: pages, teams, plans of other programs, recordings that are written, guidance, commissioning, simulation, commands.

In: the core's stages (`echostep`), which import nothing of this. Out: the command `echostep`. Each folder is a stage, as in the core.
"""
