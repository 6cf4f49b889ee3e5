"""`python -m echostep` is the command `echostep`."""

from echostep.cli import main

main()
