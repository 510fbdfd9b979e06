"""`python -m ffr_prep` is the command `ffr-prep`."""

from ffr_prep.cli import main

main()
