"""A cantilever bent far beyond what one frame can follow: bodies in a row, each with its own frame."""

from __future__ import annotations

import numpy as np

from ffr_dyn.analyses.static import static
from ffr_dyn.scene.forces import Load
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_gallery.bodies import beam
from ffr_gallery.exhibit import Claim, Curve, Exhibit, Panel, Proof
from ffr_gallery.large_deformation import exact

FORCE = 4.0  # EI / L^2
PARTS = (1, 2, 4, 8)


def in_parts(count: int, force: float) -> Scene:
    """A clamped beam of length and bending stiffness one, as `count` beams welded in a row, with a force down at the tip."""
    models = [beam(f"part{k}", 1.0 / count, 1.0, 1.0, 4, spare=0) for k in range(count)]
    ends = ["ground.O", *(f"part{k}.b" for k in range(count))]
    return Scene(
        tuple(Body(model.name, model, position=(k / count, 0, 0)) for k, model in enumerate(models)),
        tuple(Joint(f"weld{k}", "fixed", ends[k], f"part{k}.a") for k in range(count)),
        loads=(Load("force", ends[-1], force=(0, -force, 0)),),
        ground={"O": (0, 0, 0)},
        plane="z",
    )


def deflection(count: int, force: float) -> float:
    """Of the tip [m]."""
    return float(-static(in_parts(count, force))[f"part{count - 1}.b.position"][-1, 1])


def bent_in_parts() -> Exhibit:
    """Deflections of one to eight bodies against the elastica."""
    true = exact(FORCE)
    errors = np.array([abs(deflection(count, FORCE) / true - 1) for count in PARTS])
    forces = np.geomspace(0.1, 10.0, 7)
    curves = [
        Curve(f"{count} bodies", forces, np.array([abs(deflection(count, f) / exact(f) - 1) for f in forces]))
        for count in PARTS
    ]
    return Exhibit(
        "Bodies bent beyond the theory",
        "one moving frame knows displacements to second order: under 4 EI / L^2 the tip is off by 1.7 %",
        "several bodies in a row: each turns little in its own frame, and the error falls with the fourth power",
        (
            Claim("deflection under 4 EI / L^2, eight bodies", true, deflection(8, FORCE), 1.0001, "L"),
            Claim("error of four bodies over that of eight", 16.0, float(errors[2] / errors[3]), 1.1),
        ),
        (
            Proof("deflection off, one body", float(errors[0]), 0.01, True),
            Proof("deflection off, eight bodies", float(errors[-1]), 1e-4, False),
        ),
        (
            Panel(
                "cantilever with a force at its tip",
                "force [EI / L^2]",
                "deflection off by",
                tuple(curves),
                log=(True, True),
            ),
        ),
    )
