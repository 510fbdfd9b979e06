"""The command `ffr-dyn show`."""

from __future__ import annotations

from pathlib import Path

import click

from ffr_dyn.cli.run import at_moment, parameter_option, scene_argument, time_option
from ffr_prep.common.command import OUTPUT_FILE, reserve
from ffr_prep.common.entries import assignments

EXAMPLE = """\b
Example:
  ffr-dyn show slider_crank.toml                    a window
  ffr-dyn show slider_crank.toml -o scene.html      a page that works offline and can be turned with the mouse
  ffr-dyn show slider_crank.toml -p crank.length=0.06 -o scene.png
"""


@click.command(epilog=EXAMPLE)
@scene_argument
@click.option("-o", "--output", type=OUTPUT_FILE, help=".html or .png; default: a window.")
@parameter_option
@time_option
def show(scene: Path, output: Path | None, parameters: tuple[str, ...], time: float | None) -> None:
    """Draw SCENE before it runs: bodies, joints with axes, drivers, forces, markers by name, the ground.

    It is drawn as assembled; bodies that assembly moves visibly are also drawn, translucent, where the scene puts
    them. A scene that cannot be assembled is drawn as declared, with lines between points that a joint ties and that
    are apart.
    """
    from ffr_dyn.analyses.static import Static
    from ffr_dyn.pictures.scene_view import drawn, open_window, scene_view
    from ffr_dyn.scene_file.read import load_scene

    reserve("-o", output, (".html", ".png"))
    loaded, settings = load_scene(scene, assignments(parameters))
    seen = scene_view(loaded, at_moment(settings, Static(), time, ()).time)
    if output is None:
        open_window(seen)
    else:
        drawn(seen, output)
        click.echo(f"picture  {output}")
    if seen.trouble:
        click.echo(f"note     drawn as declared: {seen.trouble}")
