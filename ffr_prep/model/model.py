"""A finite-element model of any kind, as far as a reduction needs it, and its reduction to a flexible body."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ffr_prep.body import BeamForces, Surface
from ffr_prep.common.arrays import Array
from ffr_prep.common.brief import Brief, Rows, listed
from ffr_prep.model.coupled import CoupledModel
from ffr_prep.model.cuts import Cuts
from ffr_prep.model.invariants import InertiaIntegrals
from ffr_prep.model.second_order import SecondOrder


@dataclass(frozen=True, repr=False)
class Model(Brief):
    """The interface between a model and its reduction, for all elements; z are the independent coordinates of `coupled`.

    coupled    : stiffness, mass, interfaces and inertial loads
    inertia    : inertia integrals of a basis (Z, n)
    surface    : what is drawn, with the basis (Z, n) at its points; None of nothing
    stressed   : the same with stress modes, and section forces where there are beams; None where no stress is known
    stiffening : (r, n, n) geometric stiffness of a basis (Z, n) under r loads, of their static displacements (Z, r) and
                 their amplitudes (12 + 6 I, r) of the known loads (`ffr_prep.model.reactions`), reactions included
    second     : second order of a basis (Z, n), in the sense of `stiffening`
    recovery   : how the stress is recovered, in words
    record     : what the model is; JSON values
    packages   : whose versions are recorded
    doubts     : what the integrals of a basis (Z, n) cannot be trusted with, in words
    mesh_energy: (n,) twice the strain energy that the size of the elements adds to a basis (Z, n); None where the elements
                 are not known
    damping    : (n, n) damping matrix of a basis (Z, n); None where the model has none
    massless   : some coordinates have no mass
    unstressed : stresses are not known, and with them neither `stiffening` nor `second`: the body is linear
    diagnose   : called when a computation has failed; raises InputError where the model is found to be the cause
    cut        : what makes the model of each part that a body is cut into; None where the model cannot be cut

    >>> model = fp.from_mesh(fp.read_mesh("rod.geo"), fp.material("steel"))
    """

    coupled: CoupledModel
    inertia: Callable[[Array], InertiaIntegrals]
    surface: Callable[[Array], Surface | None]
    stressed: Callable[[Array], Surface | None]
    stiffening: Callable[[Array, Array, Array], Array]
    second: Callable[[Array], SecondOrder]
    recovery: str
    record: Mapping[str, Any]
    packages: tuple[str, ...] = ("ffr", "numpy", "scipy", "scikit-fem")
    doubts: Callable[[Array], list[str]] = lambda _: []
    mesh_energy: Callable[[Array], Array | None] = lambda _: None
    damping: Callable[[Array], Array | None] = lambda _: None
    massless: bool = False
    unstressed: bool = False
    diagnose: Callable[[], None] = lambda: None
    cut: Callable[[Cuts], Sequence[Callable[[], Model]]] | None = None

    def _rows(self) -> Rows:
        kind = [key for key in ("mesh", "frame", "matrices") if key in self.record]
        return [
            ("made of", listed(kind or self.record.get("parts", ()))),
            *self.coupled._rows(),
            ("warnings", listed(self.record.get("warnings", []))),
        ]


def summed(parts: Sequence[InertiaIntegrals]) -> InertiaIntegrals:
    """The integrals over several parts of a body."""
    return InertiaIntegrals(**{key: sum(vars(part)[key] for part in parts) for key in vars(parts[0])})


def merged(parts: Sequence[Surface | None]) -> Surface | None:
    """One surface of several; with stress where all have it. None of none."""
    surfaces = [surface for surface in parts if surface is not None]
    if not surfaces:
        return None
    first = np.cumsum([0, *(len(surface.points) for surface in surfaces)])
    beams = [surface.beams for surface in surfaces if surface.beams is not None]
    stress = [surface.stress for surface in surfaces if surface.stress is not None]
    moduli = [surface.moduli for surface in surfaces if surface.moduli is not None]
    whole = len(stress) == len(surfaces)
    return Surface(
        points=np.concatenate([surface.points for surface in surfaces]),
        triangles=np.concatenate([s.triangles + start for s, start in zip(surfaces, first, strict=False)]),
        Phi=np.concatenate([surface.Phi for surface in surfaces]),
        stress=np.concatenate(stress) if whole else None,
        moduli=np.concatenate(moduli) if whole else None,
        beams=_merged_beams(beams) if beams else None,
    )


def _merged_beams(beams: Sequence[BeamForces]) -> BeamForces:
    positions, axes, modes = ([getattr(one, key) for one in beams] for key in ("positions", "axes", "modes"))
    return BeamForces(np.concatenate(positions), np.concatenate(axes), np.concatenate(modes))
