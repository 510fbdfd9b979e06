"""The command `ffr-dyn export`."""

from __future__ import annotations

from pathlib import Path

import click

from ffr_prep.common.command import INPUT_FILE, OUTPUT_FILE, reserve

NOTES = """\b
Formats, by the suffix:
  .vtkhdf   ParaView 5.12 or later: one mesh, displacements and stress over time; warp by the vector "displacement"
  .pvd      ParaView and others: a .vtu file for each row, in a folder of the same name
  .glb      glTF 2.0: moving bodies for Blender, slides, web pages
  .mat      MATLAB: histories as structures
  .csv      spreadsheets: a column for each component

\b
Example:
  ffr-dyn export out/result.nc -o out/motion.vtkhdf
  ffr-dyn export out/result.nc rod.tip.position 'hinge.*' -o out/tip.csv
"""
SUFFIXES = (".vtkhdf", ".pvd", ".glb", ".mat", ".csv")


@click.command(epilog=NOTES)
@click.argument("result", type=INPUT_FILE)
@click.argument("names", nargs=-1)
@click.option("-o", "--output", type=OUTPUT_FILE, required=True, help="File to write; its suffix is the format.")
def export(result: Path, names: tuple[str, ...], output: Path) -> None:
    """Write RESULT for another program; of .mat and .csv only the quantities NAMES, where * and ? match.

    The result file itself is netCDF-4, which xarray, MATLAB and others open as it is.
    """
    from fnmatch import fnmatchcase

    from ffr_dyn.pictures import export as exports
    from ffr_dyn.results.file import load_result

    reserve("-o", output, SUFFIXES)
    loaded = load_result(result)
    fitting = [[of for of in loaded.quantities if fnmatchcase(of, name)] or [name] for name in names]
    written = exports.export(loaded, output, [one for of in fitting for one in of] if names else None)
    click.echo(f"file     {written}")
