"""Accuracy of the bodies of `ffr_prep`: against closed forms and independently computed motions.

    python -m benchmarks.preparation

prints a line for each figure with its goal, and ends with code 1 if one is missed. The size and speed of large models are
those of `benchmarks.size`. Sources stand with the figures; the motions are in tests/reference.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import scipy.linalg

from benchmarks.preparation_bodies import (
    ROD_STEEL,
    STEEL,
    bar,
    pendulum_rod,
    ring_of_beams,
    rod_of_beams,
    rotating,
    slider_crank_rod,
    slider_crank_section,
    spin_up_beam,
    strip,
    thin_ring,
    three_theories,
    tree,
)
from benchmarks.scenes import slider_crank
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.functions.time_functions import user
from ffr_dyn.integrators import ROS2
from ffr_dyn.results.result import Result
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import FlexibleBody, truncated
from ffr_prep.body.planar import in_plane
from ffr_prep.model.reference import FixedTo, MeanAxis, SimplySupported
from ffr_prep.reduction.conversion import with_reference

Array = np.ndarray

REFERENCE = Path(__file__).resolve().parent.parent / "tests" / "reference"
# First flap frequency by the speed: series, as in Wright, Smith, Thresher & Wang, J. Appl. Mech. 49 (1982) 197-202.
FLAP = {
    0: 3.5160152685,
    1: 3.6816468140,
    2: 4.1373195730,
    3: 4.7972785324,
    4: 5.5850014209,
    5: 6.4495447486,
    6: 7.3603730193,
}
# Errors of the first frequency of clamped-free continua, interface at the tip, by fixed-interface modes: exact components.
BAR = {0: 0.10265779, 1: 4.4653833e-3, 2: 1.0297938e-3, 4: 1.8232966e-4}
BEAM = {0: 4.7543236e-3, 1: 3.4702439e-4, 2: 5.8375818e-5, 4: 5.4086114e-6}
SPIN_UP = {5.0: -0.468476, 6.8: -0.573761, 10.0: -0.362815}


@dataclass(frozen=True)
class Figure:
    """A goal and the figure found: the largest value that meets it (or the smallest, where `above`)."""

    what: str
    found: float
    goal: float
    above: bool = False

    @property
    def met(self) -> bool:
        """Whether it is."""
        return self.found >= self.goal if self.above else self.found <= self.goal


# ---- bodies -------------------------------------------------------------------------------------------------------


def inertia() -> Iterator[Figure]:
    """Beams in arbitrary orientation, against sums over prisms."""
    body, mass, first, second = tree()
    length = np.sqrt(np.trace(second) / mass)
    yield Figure("frame of beams: mass, relative", abs(body.mass / mass - 1), 1e-12)
    yield Figure("frame of beams: first moment, relative", np.abs(body.r_dm - first).max() / (mass * length), 1e-12)
    yield Figure(
        "frame of beams: second moments, relative", np.abs(body.rr_dm - second).max() / np.trace(second), 1e-12
    )


def two_elements() -> Iterator[Figure]:
    """The connecting rod of two elements, against its matrices written out by symmetry (halves of one element)."""
    l, section = 0.15, slider_crank_section()  # noqa: E741
    EI, m = ROD_STEEL.E * section.Iz, ROD_STEEL.rho * section.A
    one = scipy.linalg.eigvalsh(
        EI / l**3 * np.array([[4 * l**2, -6 * l], [-6 * l, 12]]),
        m * l / 420 * np.array([[4 * l**2, 13 * l], [13 * l, 156]]),
    )
    other = scipy.linalg.eigvalsh(EI / l * np.array([[4, 2], [2, 4]]), m * l**3 / 420 * np.array([[4, -3], [-3, 4]]))
    body = in_plane(slider_crank_rod(elements=2, modes=6))
    across = body.omega2[body.PP_dm[1, 1].diagonal() > 0.99]
    off = np.abs(across / np.sort([*one, *other]) - 1).max()
    yield Figure("rod of two elements: squared frequencies against those by hand", off, 1e-9)


def rings() -> Iterator[Figure]:
    """Free ring in its plane (Love, Mathematical Theory of Elasticity, 293): chords instead of arcs are of second order."""
    k = np.array([2, 3])
    exact = k * (k**2 - 1) / np.sqrt(k**2 + 1) * np.sqrt(STEEL.E * 0.002**2 / 12 / STEEL.rho)
    coarse, fine = (np.sqrt(ring_of_beams(n).omega2[[0, 2]]) / exact - 1 for n in (24, 48))
    yield Figure(
        "ring of beams: order of convergence of the frequencies", float(np.log2(coarse / fine).min()), 1.9, above=True
    )
    yield Figure(
        "ring of beams: frequencies extrapolated to no element size", np.abs((4 * fine - coarse) / 3).max(), 2e-4
    )


def theories() -> Iterator[Figure]:
    """A cantilever of 1 m x 60 mm x 20 mm as beam, plates and solid."""
    (one, a), *others = three_theories()
    for name, (other, b) in zip(("quadrilaterals", "triangles", "solid"), others, strict=True):
        sign = np.sign(one.P_dm[2, a] * other.P_dm[2, b])
        frequency = np.abs(np.sqrt(other.omega2[b] / one.omega2[a]) - 1).max()
        rigid = np.abs(other.rr_dm - one.rr_dm).max() / np.trace(one.rr_dm)
        first = np.abs(other.P_dm[:, b] * sign - one.P_dm[:, a]).max() / np.sqrt(one.mass)
        moments = np.abs(other.rP_dm[:, :, b] * sign - one.rP_dm[:, :, a]).max() / np.sqrt(one.mass)
        squares = np.abs(other.PP_dm[:, :, b][..., b] * np.outer(sign, sign) - one.PP_dm[:, :, a][..., a]).max()
        yield Figure(f"cantilever of {name} against beams: two frequencies", frequency, 5e-3)
        yield Figure(f"cantilever of {name} against beams: rigid inertia", rigid, 1e-12)
        yield Figure(f"cantilever of {name} against beams: invariants of the modes", max(first, moments, squares), 2e-3)


def craig_bampton() -> Iterator[Figure]:
    """Share by which the error of the first frequency differs from that of exact components."""
    for words, errors, axial in (("bar", BAR, True), ("beam", BEAM, False)):
        exact = np.pi / 2 if axial else 1.8751040687119611**2
        found = {n: rod_of_beams(n, axial=axial) / exact - 1 for n in errors}
        yield Figure(
            f"Craig-Bampton errors of a {words}: from the series",
            max(abs(found[n] / errors[n] - 1) for n in errors),
            0.05,
        )


def steady() -> Iterator[Figure]:
    """q L^4/8 EI of a solid cantilever and rho Omega^2 R^3/E of a solid ring, through the integrals of the modes alone."""
    body, sag = bar()
    tip = body.interface("right").phi_t @ (body.P_dm.T @ (0, -9.81, 0) / body.omega2)
    yield Figure("sag of a solid cantilever", abs(tip[1] / -sag - 1), 5e-3)
    for rich in (True, False):
        ring, grown = thin_ring(rich)
        points = ring.surface.points * (1, 1, 0)
        radial = points / np.linalg.norm(points, axis=1)[:, None]
        shape = (ring.rP_dm[0, 0] + ring.rP_dm[1, 1]) / ring.omega2
        off = abs(np.einsum("pc,pcn,n->p", radial, ring.surface.Phi, shape).mean() / grown - 1)
        warned = any("steady" in warning and "spin" in warning for warning in ring.provenance["warnings"])
        if rich:
            yield Figure("growth of a spinning ring", off, 1e-2)
        yield Figure(
            f"growth {'with' if rich else 'without'} inertia relief: warnings", warned, not rich, above=not rich
        )


# ---- stiffening ---------------------------------------------------------------------------------------------------


def rotating_beams() -> Iterator[Figure]:
    """First flap frequency of a cantilever by its speed, three modes for each plane."""
    for words in ("beams", "solid"):
        body, unit = rotating(words)
        off = max(abs(_flap(body, unit, eta) / mu - 1) for eta, mu in FLAP.items())
        yield Figure(f"rotating cantilever of {words}: flap frequencies up to 6", off, 2e-3)


def _flap(body: FlexibleBody, unit: float, eta: float) -> float:
    about_z = body.stiffening[8] - body.PP_dm[0, 0] - body.PP_dm[1, 1]
    values, vectors = scipy.linalg.eigh(np.diag(body.omega2) + eta**2 * unit * about_z)
    flap = np.einsum("im,ij,jm->m", vectors, body.PP_dm[2, 2], vectors) > 0.5
    return float(np.sqrt(values[flap][0] / unit))


def spin_up() -> Iterator[Figure]:
    """Tip of a beam that spins up to 6 rad/s (Simo & Vu-Quoc; Wu & Haug), exact beam, independent, to 3e-7 m."""
    body = truncated(in_plane(spin_up_beam()), 3)
    scene = Scene(
        (Body("beam", body),), (Joint("axis", "revolute", "ground.O", "beam.root"),),
        (Driver("motor", "axis", user(_spinning)),), ground={"O": (0, 0, 0)},
    )  # fmt: skip
    result = integrate(scene, end=10.0, output_step=0.1, method=ROS2(2e-3))
    tip = result["beam.q"] @ body.interface("tip").phi_t[1]
    off = max(abs(np.interp(t, result.time, tip) - d) for t, d in SPIN_UP.items())
    yield Figure("spin-up with three modes: tip [m]", off, 1e-3)


def _spinning(t: float) -> tuple[float, float, float]:
    T, speed, a = 15.0, 6.0, 2 * np.pi / 15.0
    return (
        speed / T * (t**2 / 2 + (np.cos(a * t) - 1) / a**2),
        speed / T * (t - np.sin(a * t) / a),
        speed / T * (1 - np.cos(a * t)),
    )


def slider_cranks() -> Iterator[Figure]:
    """Offset of the middle of the rod from the chord over 0.084 s; crank at 150 rad/s."""
    body = slider_crank_rod(elements=24, modes=10)
    middle = np.abs(body.surface.points[:, 0] - 0.15) < 1e-9
    shape = body.surface.Phi[middle].mean(axis=0)[1]
    runs = [
        integrate(_switched(slider_crank(body), on), end=0.084, output_step=4e-4, method=ROS2(5e-6))
        for on in (False, True)
    ]
    linear, stiffened = (run["rod.q"] @ shape for run in runs)
    in_theory, exact = (_table(f"slider_crank_{name}.csv")[:, 1] for name in ("linear", "exact"))
    n = min(len(linear), len(in_theory), len(exact))
    yield Figure("slider-crank, linear: against linear theory [m]", np.abs(linear - in_theory)[:n].max(), 1e-5)
    yield Figure("slider-crank, stiffened: against the exact peak", abs(stiffened.max() / exact.max() - 1), 0.01)
    yield Figure("slider-crank, stiffened: against the exact motion [m]", np.abs(stiffened[:n] - exact[:n]).max(), 2e-4)
    yield Figure("slider-crank, linear: the peak fails by", abs(linear.max() / exact.max() - 1), 0.15, above=True)
    yield Figure("slider-crank, linear: warnings of the spin", _warned(runs[0]), 1, above=True)


def pendulums() -> Iterator[Figure]:
    """Tip of a rod of 1.2 m, E = 7e10 Pa, over 2 s, released from the horizontal."""
    body = pendulum_rod()
    scene = Scene(
        (Body("rod", body),), (Joint("hinge", "revolute", "ground.O", "rod.root"),), ground={"O": (0, 0, 0)},
        gravity=(0.0, -9.81, 0.0),
    )  # fmt: skip
    runs = [integrate(_switched(scene, on), end=2.0, output_step=0.01, method=ROS2(2.5e-5)) for on in (False, True)]
    linear, stiffened = (run["rod.tip.position"][:, :2] for run in runs)
    in_theory, exact = (_table(f"pendulum_{name}.csv")[:, 1:3] for name in ("linear", "exact"))
    off = np.abs(linear[: len(in_theory)] - in_theory).max()
    yield Figure("pendulum, linear: against linear theory, half a second [m]", off, 1e-5)
    yield Figure("pendulum, stiffened: tip against the exact motion [m]", np.abs(stiffened - exact).max(), 1.5e-4)
    yield Figure("pendulum, linear: the tip fails by [m]", np.abs(linear - exact).max(), 5e-4, above=True)
    yield Figure("pendulum, linear: warnings of the spin", _warned(runs[0]), 1, above=True)


def _switched(scene: Scene, stiffening: bool) -> Scene:
    return replace(scene, bodies=tuple(replace(body, stiffening=stiffening) for body in scene.bodies))


def _warned(run: Result) -> int:
    return sum("without geometric stiffening" in note for note in run.attributes["notes"])


def _table(name: str) -> Array:
    return np.loadtxt(REFERENCE / name, delimiter=",")


def buckling() -> Iterator[Figure]:
    """Cantilevers under a moment and a force at the end: pi sqrt(EI GJ)/L (J. H. Argyris et al., Comput. Meth. Appl. Mech.
    Engng 20 (1979) 105-155), 4.0126 sqrt(EI GJ)/L^2 (Timoshenko & Gere, Theory of Elastic Stability, 6.3)."""
    for kind, off in (("beams", 1e-3), ("solid", 0.03)):
        body = strip(kind, FixedTo("root"))
        turned = body.interface("tip").phi_r ** 2 @ (1 / body.omega2)  # L / GJ, L / EI
        for load, factor, number in (("moment", np.pi, 12 + 11), ("force", 4.0126, 12 + 7)):
            scaled = body.stiffening[number] / np.sqrt(np.outer(body.omega2, body.omega2))
            critical = -1 / np.linalg.eigvalsh(scaled)[0]
            exact = factor / np.sqrt(turned[0] * turned[1])
            yield Figure(f"lateral buckling of {kind} by an end {load}", abs(critical / exact - 1), off)


def conversions() -> Iterator[Figure]:
    """Geometric stiffness in another frame, of the body alone and of a direct reduction there."""
    for kind in ("beams", "solid"):
        for new in (SimplySupported("root", "tip"), MeanAxis()):
            converted, direct = with_reference(strip(kind, FixedTo("root")), new), strip(kind, new)
            shapes = (body.surface.Phi.reshape(-1, body.n) for body in (converted, direct))
            X = np.linalg.lstsq(*shapes, rcond=None)[0]
            scale = np.sqrt(np.outer(direct.omega2, direct.omega2))
            off = np.abs((X.T @ converted.stiffening @ X - direct.stiffening) / scale).max()
            share = off / np.abs(direct.stiffening / scale).max()
            yield Figure(f"stiffness of {kind} converted to {type(new).__name__}: from reducing there", share, 1e-6)


# ---- all of them --------------------------------------------------------------------------------------------------

GROUPS = (
    inertia, two_elements, rings, theories, craig_bampton, steady, rotating_beams, spin_up, slider_cranks, pendulums,
    buckling, conversions,
)  # fmt: skip


def main() -> None:
    """Print all figures."""
    missed = 0
    for group in GROUPS:
        for figure in group():
            missed += not figure.met
            bound = f"{'at least' if figure.above else 'at most'} {figure.goal:g}"
            print(f"{figure.what:72}{figure.found:11.3g}  {bound:18}{'met' if figure.met else 'MISSED'}", flush=True)
    sys.exit(1 if missed else 0)


if __name__ == "__main__":
    main()
