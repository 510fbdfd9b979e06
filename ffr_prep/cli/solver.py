"""The options of ffr-prep that choose a solver."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from ffr_prep.solvers.factor import Solver


def solver_options(command: Callable[..., None]) -> Callable[..., None]:
    """Adds --solver and --ranks, which arrive as `solver` and `ranks`."""
    command = click.option(
        "--ranks", type=int, default=1, show_default=True, help="MPI processes of the solver slepc."
    )(command)
    return click.option(
        "--solver",
        type=click.Choice(["cholesky", "superlu", "pardiso", "slepc"]),
        default="cholesky",
        show_default=True,
        help="What factorises and finds modes: docs/size.md tells when another than our own serves.",
    )(command)


def solver_of(options: Mapping[str, Any]) -> Solver:
    """The solver of the options; InputError for ranks that cannot be."""
    from ffr_prep.solvers.factor import Solver

    return Solver(options["solver"], options["ranks"])
