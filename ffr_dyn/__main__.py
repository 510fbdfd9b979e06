"""`python -m ffr_dyn` is the command `ffr-dyn`."""

from ffr_dyn.cli import main

main()
