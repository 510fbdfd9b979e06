"""`python -m ffr_prep.cli` is the command."""

from ffr_prep.cli import main

main()
