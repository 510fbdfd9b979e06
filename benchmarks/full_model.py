"""Frequency responses of unreduced solids: with joints as constraints on their interfaces, frequency by frequency.

    [K (1 + i w beta) - w^2 M   J^T] [z]   [f]
    [J                            0] [l] = [0]

in the independent coordinates z of a finite-element model and those of what is rigid beside it. At rest nothing else
acts, so that this is the linearised machine without any floating frame, reduction or compiled code.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import spsolve

import ffr_dyn as fd
import ffr_prep as fp
from benchmarks.preparation_bodies import STEEL, box
from ffr_prep.body import FlexibleBody
from ffr_prep.model.model import Model
from ffr_prep.model.reference import FixedTo, ReferenceConditions, SimplySupported
from ffr_prep.reduction.methods.rubin import Rubin
from ffr_prep.reduction.quality import quality_of
from ffr_prep.reduction.selection import Accuracy, Band

Array = np.ndarray

LENGTH = 0.3  # m, of the box, along x
BAND = Band(10.0, 3000.0)
PROMISE = 1e-4  # of the receptances in the band
BETA = 3e-6  # s: a damping ratio of 1 % at 1 kHz
THROW, ANGLE = 0.1, 0.7  # m, rad: of the crank
CRANK_INERTIA, SLIDER_MASS = 2e-3, 0.5  # kg m^2, kg


@cache
def solid(cells: tuple[int, int, int] = (10, 2, 2)) -> Model:
    """A steel box of 300 mm x 30 mm x 20 mm, held rigidly at its ends."""
    ends = [fp.InterfaceRegion("root", "left"), fp.InterfaceRegion("tip", "right")]
    return fp.from_mesh(box((LENGTH, 0.03, 0.02), cells), STEEL, ends)


def reduced(model: Model, reference: ReferenceConditions) -> tuple[FlexibleBody, float]:
    """The body with as many modes as the promised accuracy needs, and the error that its report states in the band."""
    request = fp.Request(name="box", reference=reference, reduction=Rubin(Accuracy(BAND, PROMISE)), quality=BAND)
    body = fp.reduce(model, request)
    found = quality_of(body.provenance)
    assert found is not None
    return fp.damped(body, beta=BETA), float(found.receptance_errors.max())


def frequencies() -> Array:
    """(60,) [Hz] over the band."""
    return np.geomspace(BAND.low, BAND.high, 60)


def cantilever(model: Model) -> tuple[Array, Array, float]:
    """Receptance of the tip across, clamped at the root: of the scene, of the full model, and what the report promises."""
    body, promised = reduced(model, FixedTo("root"))
    clamp = fd.Joint("clamp", "fixed", "ground.O", "box.root")
    scene = fd.Scene((fd.Body("box", body),), (clamp,), ground={"O": (0, 0, 0)})
    found = fd.response(
        scene, input="box.tip.force.y", outputs=("box.tip.position.y",), frequencies=frequencies().tolist()
    )
    C = model.coupled.C.tocsr()
    tip = C[[7]].toarray()[0]
    return found["transfer"][:, 0] @ [1, 1j], _solved(model, np.zeros((0, 0)), C[:6], tip, tip), promised


def slider_crank(model: Model) -> tuple[Array, Array, float]:
    """Acceleration of the slider by a moment at the crank, at rest: of the scene, of the full model, and the promise."""
    body, promised = reduced(model, SimplySupported("root", "tip"))
    scene = _machine(body)
    found = fd.response(
        scene, input="motor.moment", outputs=("slider.pin.acceleration.x",), frequencies=frequencies().tolist()
    )
    pin, tilt = _geometry()
    R = np.array(
        [[np.cos(tilt), np.sin(tilt), 0], [-np.sin(tilt), np.cos(tilt), 0], [0, 0, 1.0]]
    )  # into the rod's axes
    across = R @ np.array([-pin[1], pin[0], 0.0])
    C = model.coupled.C.tocsr()
    held = C[[0, 1, 2, 3, 4, 6, 7, 8, 9, 10]]  # all but the turning of the pins
    rigid = np.zeros((10, 2))
    rigid[:3, 0], rigid[5:8, 1] = -across, -R[:, 0]
    J = sp.hstack([held, sp.csr_array(rigid)])
    moment, slide = np.zeros(J.shape[1]), np.zeros(J.shape[1])
    moment[-2] = slide[-1] = 1.0
    H = _solved(model, np.diag([CRANK_INERTIA, SLIDER_MASS]), J, moment, slide)
    return found["transfer"][:, 0] @ [1, 1j], -((2 * np.pi * frequencies()) ** 2) * H, promised


def _geometry() -> tuple[Array, float]:
    """Where the crank pin is [m], and how the rod is inclined [rad]."""
    pin = THROW * np.array([np.cos(ANGLE), np.sin(ANGLE), 0.0])
    return pin, -float(np.arcsin(pin[1] / LENGTH))


def _machine(body: FlexibleBody) -> fd.Scene:
    pin, tilt = _geometry()
    end = pin[0] + LENGTH * np.cos(tilt)
    crank = fd.rigid_body("crank", mass=1.0, inertia=(1e-3, 1e-3, CRANK_INERTIA), points={"hub": (0, 0, 0), "pin": pin})
    slider = fd.rigid_body("slider", mass=SLIDER_MASS, inertia=(1e-3, 1e-3, 1e-3), points={"pin": (0, 0, 0)})
    rod = fd.Body("box", body, position=tuple(pin), rotation=(0, 0, tilt))
    return fd.Scene(
        (fd.Body("crank", crank), rod, fd.Body("slider", slider, position=(end, 0, 0))),
        (
            fd.Joint("bearing", "revolute", "ground.O", "crank.hub"),
            fd.Joint("crankpin", "revolute", "crank.pin", "box.root"),
            fd.Joint("wrist", "revolute", "box.tip", "slider.pin"),
            fd.Joint("guide", "translational", "ground.O", "slider.pin", axis=(1, 0, 0)),
        ),
        (fd.Driver("motor", "bearing", 0.0),),
        ground={"O": (0, 0, 0)},
    )


def _solved(model: Model, rigid: Array, J: sp.csr_array, load: Array, seen: Array) -> Array:
    """(F,) the coordinate `seen` under a unit `load`, with the rows J closed."""
    coupled = model.coupled
    none = sp.csr_array(rigid.shape)
    K, M = sp.block_diag([coupled.K, none]), sp.block_diag([coupled.M, sp.csr_array(rigid)])
    size = float(np.abs(coupled.K.diagonal()).mean())  # rows as large as the stiffness
    zero = sp.csr_array((J.shape[0], J.shape[0]))
    right = np.concatenate([load, np.zeros(J.shape[0])]).astype(complex)
    found = []
    for w in 2 * np.pi * frequencies():
        A = sp.block_array([[K * (1 + 1j * w * BETA) - w**2 * M, size * J.T], [size * J, zero]])
        found.append(seen @ spsolve(A.tocsc(), right)[: seen.size])
    return np.array(found)
