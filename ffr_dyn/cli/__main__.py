"""`python -m ffr_dyn.cli` is the command."""

from ffr_dyn.cli import main

main()
