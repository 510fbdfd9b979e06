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

import numpy as np

import ffr_dyn as fd
import ffr_prep as fp

if __name__ == "__main__":
    # The first time only, while everything else is loaded and the rod is meshed and reduced.
    fd.begin_compiling(fd.ROS2)

GEOMETRY = Path(__file__).resolve().parent.parent / "meshes" / "connecting_rod.geo"
THROW, ROD = 0.045, 0.150  # crank radius and distance of the eyes [m]
SPEED = 4000 * 2 * np.pi / 60  # [rad/s]
TURN = 2 * np.pi / SPEED  # [s]
STRESS = 60e6  # [Pa], end of the colour bar


def reduced_rod() -> fp.FlexibleBody:
    """The rod with eight fixed-interface modes and the static modes of both eyes."""
    mesh = fp.read_mesh(GEOMETRY, unit="mm", size=8)
    rod = fp.reduce(
        fp.from_mesh(mesh, fp.material("steel"), [fp.InterfaceRegion("big_eye"), fp.InterfaceRegion("small_eye")]),
        fp.Request(
            name="rod", reference=fp.SimplySupported("big_eye", "small_eye"), reduction=fp.CraigBampton(8), stress=True
        ),
    )
    return fp.with_point(rod, "middle", np.array([ROD / 2, 0.013, 0.0]))


def slider_crank(rod: fp.FlexibleBody) -> fd.Scene:
    """Crank, rod and piston; the piston slides along x."""
    crank = fp.rigid_body(
        "crank", mass=1.2, inertia=(1e-3, 1e-3, 2e-3), points={"bearing": np.zeros(3), "pin": np.array([THROW, 0, 0])}
    )
    piston = fp.rigid_body("piston", mass=0.45, inertia=(3e-4, 3e-4, 3e-4), points={"pin": np.zeros(3)})
    return fd.Scene(
        name="slider-crank with a flexible connecting rod",
        ground={"bearing": (0, 0, 0)},
        bodies=(
            fd.Body("crank", crank),
            fd.Body("rod", rod, position=(THROW, 0, 0), damping=0.01),
            fd.Body("piston", piston, position=(THROW + ROD, 0, 0)),
        ),
        joints=(
            fd.Joint("main_bearing", "revolute", "ground.bearing", "crank.bearing"),
            fd.Joint("crank_pin", "revolute", "crank.pin", "rod.big_eye"),
            fd.Joint("piston_pin", "revolute", "rod.small_eye", "piston.pin"),
            fd.Joint("cylinder", "translational", "ground.bearing", "piston.pin", axis=(1, 0, 0)),
        ),
        drivers=(fd.Driver("motor", "main_bearing", fd.polynomial(0, SPEED)),),
        plane="z",  # the rod is symmetric about it, its mesh of tetrahedra to some thousandths
    )


def motion(rod: fp.FlexibleBody, path: Path | None = None) -> fd.Result:
    """Three turns, from the deflections that the speed asks for."""
    with fd.progress("slider-crank", 3 * TURN) as update:
        return fd.forward(
            slider_crank(rod),
            end=3 * TURN,
            output_step=TURN / 240,
            method=fd.ROS2(TURN / 4800),
            begin="quasi-static",
            path=path,
            progress=update,
        )


def pictures(result: fd.Result, folder: Path) -> None:
    """Slider motion, mid-rod deflection and reactions, and two films: coloured by deflection and by stress."""
    fd.plot(
        result, ["piston.pin.position.x", "piston.pin.velocity.x"], folder / "slider_motion.png", title="Piston motion"
    )
    fd.plot(
        result,
        ["rod.middle.displacement.x", "rod.middle.displacement.y"],
        folder / "mid_rod_deflection.png",
        title="Deflection of the rod's middle from the line between its eyes",
    )
    forces = ["crank_pin.force.x", "crank_pin.force.y", "piston_pin.force.x", "piston_pin.force.y", "motor.moment.z"]
    fd.plot(result, forces, folder / "reactions.png", title="Joint reactions and motor torque")
    fd.animate(result, folder / "motion.gif", scale="auto", fps=20)
    loads = ["crank_pin.force", "rod.middle.displacement.y"]
    fd.animate(result, folder / "motion.html", scale="auto", colour="von-mises", limit=STRESS, plots=loads)


def stresses(result: fd.Result, folder: Path) -> None:
    """Hot spots of the last turn."""
    for line in fd.report_lines(fd.stress_report(result, folder, since=2 / 3 * result.time[-1], count=3)):
        print(line)


def headline(result: fd.Result) -> str:
    """The steady turn in numbers, with the errors that the run tells of them."""
    last, errors = result.time >= 2 * TURN, result.attributes["errors"]
    bend, load = (np.abs(result[name][last]).max() for name in ("rod.middle.displacement.y", "crank_pin.force"))
    off, unsure = (errors[name][0] for name in ("rod.middle.displacement", "crank_pin.force"))
    return (
        f"the rod bends by {1e6 * bend:.2f} um (error {1e6 * off:.2g} um), "
        f"its pin carries {load / 1e3:.2f} kN (error {unsure / 1e3:.2g} kN)"
    )


def main() -> None:
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out/connecting_rod")
    began = time.monotonic()
    rod = reduced_rod()
    fp.save_body(rod, folder / "rod.ffr")
    print(f"body      {rod.mass:.4f} kg, {rod.n} modes, {rod.frequencies[0]:.0f} to {rod.frequencies[-1]:.0f} Hz")
    result = motion(rod, folder / "result.nc")
    print(f"motion    the last of 3 turns at 4000 rev/min: {headline(result)}")
    for note in result.attributes["notes"]:
        print(f"note      {note}")
    stresses(result, folder / "stress")
    pictures(result, folder)
    print(f"results   {folder} ({time.monotonic() - began:.1f} s)")


if __name__ == "__main__":
    main()
