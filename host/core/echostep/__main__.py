# SPDX-License-Identifier: MIT
"""`python -m echostep` runs the command `echostep`."""

from echostep.cli import main

main()
