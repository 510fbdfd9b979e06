"""Modes of a beam whose reference conditions are not those of its joints."""

from __future__ import annotations

import numpy as np

from ffr_dyn.analyses.linearise import linearise
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_gallery.bodies import beam
from ffr_gallery.exhibit import Claim, Curve, Exhibit, Panel, Proof

EXACT = np.pi**2  # rad/s of a beam of length, density and bending stiffness one between two hinges


def first_frequency(held: str, modes: int) -> float:
    """[rad/s] of the beam between a hinge and a hinge that slides, for modes that its frame holds so."""
    rod = beam("rod", 1.0, 1.0, 1.0, modes, held=held)
    scene = Scene(
        (Body("rod", rod),),
        (
            Joint("left", "revolute", "ground.O", "rod.a"),
            Joint("right", "point-on-line", "ground.O", "rod.b", axis=(1, 0, 0)),
        ),
        ground={"O": (0, 0, 0)},
        plane="z",
    )
    return float(np.abs(linearise(scene).eigenvalues.imag).min())


def reference_conditions() -> Exhibit:
    """A beam on two hinges, by modes of one that is clamped at one end, and of one that is held at both."""
    counts = np.arange(1, 7)
    clamped, supported = (np.array([first_frequency(held, int(n)) for n in counts]) for held in ("root", "ends"))
    return Exhibit(
        "Reference conditions against joints",
        "few modes of a beam clamped at one end cannot bend as one on two hinges does: it is too stiff",
        "reference conditions that the joints keep (held at both ends), or static shapes for what they do not",
        (Claim("first frequency, one mode held at both ends", EXACT, float(supported[0]), 1.001, "rad/s"),),
        (
            Proof("frequency off with one mode clamped at one end", float(clamped[0] / EXACT - 1), 0.02, True),
            Proof("frequency off with one mode held at both ends", abs(float(supported[0] / EXACT - 1)), 1e-6, False),
        ),
        (
            Panel(
                "a beam on two hinges: first frequency", "modes", "relative error",
                (
                    Curve("clamped at one end", counts, np.maximum(clamped / EXACT - 1, 1e-12), points=True),
                    Curve("held at both ends", counts, np.maximum(supported / EXACT - 1, 1e-12), points=True),
                ),
                log=(False, True),
            ),
        ),
    )  # fmt: skip
