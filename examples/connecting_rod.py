"""The main job: a connecting rod from geometry to a running slider-crank.

    python examples/connecting_rod.py [folder]

Meshes meshes/connecting_rod.geo, reduces it under simply supported reference conditions, runs it between a rigid crank at
4000 rev/min and a rigid piston, finds where the rod is stressed most, and leaves body file, result, plots and animations
in the folder (out/connecting_rod).
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import ffr_prep as fp
from ffr_dyn.compile.first_use import begin_compiling
from ffr_dyn.integrators import ROS2

if __name__ == "__main__":
    begin_compiling(ROS2)  # the first time only, while everything else is loaded and the rod is meshed and reduced

import numpy as np

from ffr_dyn.analyses.forward import forward
from ffr_dyn.cli.progress_bar import progress
from ffr_dyn.functions.time_functions import polynomial
from ffr_dyn.pictures.animate import animate
from ffr_dyn.pictures.histories import plot
from ffr_dyn.pictures.stress_report import report_lines, stress_report
from ffr_dyn.results.result import Result
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import FlexibleBody, rigid_body, save_body, with_point
from ffr_prep.mesh.mesh import read_mesh
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.material import material
from ffr_prep.model.reference import SimplySupported
from ffr_prep.reduction.methods.craig_bampton import CraigBampton

GEOMETRY = Path(__file__).resolve().parent.parent / "meshes" / "connecting_rod.geo"
THROW, ROD = 0.045, 0.150  # crank radius and distance of the eyes [m]
SPEED = 4000 * 2 * np.pi / 60  # [rad/s]
TURN = 2 * np.pi / SPEED  # [s]
STRESS = 60e6  # [Pa], end of the colour bar: above what is left when the vibration of the start has decayed


def reduced_rod() -> FlexibleBody:
    """The rod with eight fixed-interface modes and the static modes of both eyes."""
    mesh = read_mesh(GEOMETRY, unit="mm", size=8)
    rod = fp.reduce(
        fp.from_mesh(mesh, material("steel"), [InterfaceRegion("big_eye"), InterfaceRegion("small_eye")]),
        fp.Request(
            name="rod", reference=SimplySupported("big_eye", "small_eye"), reduction=CraigBampton(8), stress=True
        ),
    )
    return with_point(rod, "middle", np.array([ROD / 2, 0.013, 0.0]))


def slider_crank(rod: FlexibleBody) -> Scene:
    """Crank, rod and piston; the piston slides along x."""
    crank = rigid_body(
        "crank", mass=1.2, inertia=(1e-3, 1e-3, 2e-3), points={"bearing": np.zeros(3), "pin": np.array([THROW, 0, 0])}
    )
    piston = rigid_body("piston", mass=0.45, inertia=(3e-4, 3e-4, 3e-4), points={"pin": np.zeros(3)})
    return Scene(
        name="slider-crank with a flexible connecting rod",
        ground={"bearing": (0, 0, 0)},
        bodies=(
            Body("crank", crank),
            Body("rod", rod, position=(THROW, 0, 0), damping=0.01),
            Body("piston", piston, position=(THROW + ROD, 0, 0)),
        ),
        joints=(
            Joint("main_bearing", "revolute", "ground.bearing", "crank.bearing"),
            Joint("crank_pin", "revolute", "crank.pin", "rod.big_eye"),
            Joint("piston_pin", "revolute", "rod.small_eye", "piston.pin"),
            Joint("cylinder", "translational", "ground.bearing", "piston.pin", axis=(1, 0, 0)),
        ),
        drivers=(Driver("motor", "main_bearing", polynomial(0, SPEED)),),
    )


def motion(rod: FlexibleBody, path: Path | None = None) -> Result:
    """Three turns."""
    with progress("slider-crank", 3 * TURN) as update:
        return forward(
            slider_crank(rod),
            end=3 * TURN,
            output_step=TURN / 240,
            method=ROS2(TURN / 4800),
            path=path,
            progress=update,
        )


def pictures(result: Result, folder: Path) -> None:
    """Slider motion, mid-rod deflection and reactions, and two films: coloured by deflection and by stress."""
    plot(
        result, ["piston.pin.position.x", "piston.pin.velocity.x"], folder / "slider_motion.png", title="Piston motion"
    )
    plot(
        result,
        ["rod.middle.displacement.x", "rod.middle.displacement.y"],
        folder / "mid_rod_deflection.png",
        title="Deflection of the rod's middle from the line between its eyes",
    )
    forces = ["crank_pin.force.x", "crank_pin.force.y", "piston_pin.force.x", "piston_pin.force.y", "motor.moment.z"]
    plot(result, forces, folder / "reactions.png", title="Joint reactions and motor torque")
    animate(result, folder / "motion.gif", scale="auto", fps=20)
    animate(result, folder / "motion.html", scale="auto", fps=20, colour="von-mises", limit=STRESS)


def stresses(result: Result, folder: Path) -> None:
    """Hot spots of the last turn, when the vibration of the start has decayed."""
    for line in report_lines(stress_report(result, folder, since=2 / 3 * result.time[-1], count=3)):
        print(line)


def main() -> None:
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out/connecting_rod")
    began = time.monotonic()
    rod = reduced_rod()
    save_body(rod, folder / "rod.ffr")
    print(f"body      {rod.mass:.4f} kg, {rod.n} modes, {rod.frequencies[0]:.0f} to {rod.frequencies[-1]:.0f} Hz")
    result = motion(rod, folder / "result.nc")
    bend = np.abs(result["rod.middle.displacement.y"]).max()
    load = np.abs(result["crank_pin.force"]).max()
    print(
        f"motion    3 turns at 4000 rev/min: the rod bends by {1e6 * bend:.1f} um, its pin carries {load / 1e3:.2f} kN"
    )
    for note in result.attributes["notes"]:
        print(f"note      {note}")
    stresses(result, folder / "stress")
    pictures(result, folder)
    print(f"results   {folder} ({time.monotonic() - began:.1f} s)")


if __name__ == "__main__":
    main()
