"""The reduced body: its arrays, their views, and the conditions that they satisfy."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import Any, TypeVar

import numpy as np

from ffr_prep.common.arrays import Array
from ffr_prep.common.brief import Brief, Rows, listed
from ffr_prep.common.errors import InputError
from ffr_prep.common.in_words import settings_in_words, vector_in_words

_ORTHONORMAL_TOLERANCE = 1e-8
_PARTS_TOLERANCE = 1e-9


class BodyError(InputError):
    """A body or a body file that cannot be used; the message says what is wrong and what to do.

    >>> try: body = fp.load_body("rod.ffr")
    ... except fp.BodyError as error: print(error)
    """


@dataclass(frozen=True, repr=False)
class Interface(Brief):
    """A six-coordinate node to which joints, forces and sensors attach.

    position : (3,) [m], undeformed, in the body frame
    phi_t    : (3, n) [1/sqrt(kg)], translation of the node per elastic coordinate
    phi_r    : (3, n) [rad/(m sqrt(kg))], infinitesimal rotation of the node per elastic coordinate
    kind     : "rigid" (RBE2), "mean" (RBE3) or "node"

    Raises BodyError for arrays of other shapes, and values that are not finite.

    >>> tip = body.interface("tip")
    """

    name: str
    position: Array
    phi_t: Array
    phi_r: Array
    kind: str = "node"

    def __post_init__(self) -> None:
        _freeze(self, "position", (3,))
        n = np.shape(self.phi_t)[-1]
        _freeze(self, "phi_t", (3, n))
        _freeze(self, "phi_r", (3, n))


# The components of a symmetric tensor, in the order in which they are stored; shear strains are those of the tensor.
TENSOR = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
# Section forces of beams, in element axes: tension, shear forces [N], torque and bending moments [N m].
SECTION_FORCES = ("N", "Qy", "Qz", "Mx", "My", "Mz")


@dataclass(frozen=True, repr=False)
class QuadraticField(Brief):
    """A field that is quadratic in the elastic coordinates, of rank r:  sum_r shapes_r (q . weights_r q) / 2.

    shapes  : (..., r) at every place and component, in its unit divided by m^2 kg
    weights : (r, n, n) symmetric [1]
    """

    shapes: Array
    weights: Array

    def __post_init__(self) -> None:
        n, r = np.shape(self.weights)[-1], np.shape(self.shapes)[-1]
        _freeze(self, "shapes", (*np.shape(self.shapes)[:-1], r))
        _freeze(self, "weights", (r, n, n))


@dataclass(frozen=True, repr=False)
class BeamForces(Brief):
    """Section forces of E beam elements per elastic coordinate, at the first end, the middle and the last end of each.

    positions : (E, 3, 3) undeformed places on the centroid line, in the body frame [m]
    axes      : (E, 3, 3) rotation from element to body axes
    modes     : (E, 3, 6, n) N, Qy, Qz, Mx, My, Mz at [element, place, force, :], which the part of the beam towards the
                last end exerts on the other, in element axes [N/(m sqrt(kg)), N/sqrt(kg)]
    second    : what is quadratic in the elastic coordinates of the same forces, in axes that turn with the sections; None
                where it was not computed

    Raises BodyError for arrays of other shapes, and values that are not finite.

    >>> body.surface.beams  # of a frame reduced with stress=True
    """

    positions: Array
    axes: Array
    modes: Array
    second: QuadraticField | None = None

    def __post_init__(self) -> None:
        count, n = np.shape(self.positions)[0], np.shape(self.modes)[-1]
        _freeze(self, "positions", (count, 3, 3))
        _freeze(self, "axes", (count, 3, 3))
        _freeze(self, "modes", (count, 3, 6, n))
        _check_quadratic(self.second, (count, 3, 6), n)


@dataclass(frozen=True, repr=False)
class Surface(Brief):
    """The triangulated boundary with the basis at its points: for drawing, and where fields are recovered.

    points : (P, 3) [m] undeformed; triangles : (T, 3) indices into points; Phi : (P, 3, n) [1/sqrt(kg)]
    second : second-order displacement of the points, in all Phi q + second(q); None where it was not computed
    stress : (P, 6, n) components xx, yy, zz, xy, xz, yz of the stress per elastic coordinate, in body axes
             [Pa/(m sqrt(kg))]; None where it was not recovered
    second_stress : what is quadratic in the elastic coordinates of the same stress; None where it was not computed
    moduli : (P, 2) Young's modulus [Pa] and Poisson's ratio at the points, which give the strain; with the stress. Zeros
             where the material is anisotropic, of which strain is not recovered
    beams  : section forces of beam elements; None where there are none

    Raises BodyError for parts that do not fit each other.

    >>> body.surface.points.shape
    """

    points: Array
    triangles: Array
    Phi: Array
    stress: Array | None = None
    moduli: Array | None = None
    beams: BeamForces | None = None
    second: QuadraticField | None = None
    second_stress: QuadraticField | None = None

    def __post_init__(self) -> None:
        count, n = np.shape(self.points)[0], np.shape(self.Phi)[-1]
        _freeze(self, "points", (count, 3))
        _freeze(self, "Phi", (count, 3, n))
        if (self.stress is None) != (self.moduli is None):
            raise BodyError(
                "surface: stress modes and the moduli at the same points belong together; give both or none"
            )
        if self.stress is not None:
            _freeze(self, "stress", (count, 6, n))
            _freeze(self, "moduli", (count, 2))
        if self.beams is not None and self.beams.modes.shape[-1] != n:
            raise BodyError(f"surface: the section forces have {self.beams.modes.shape[-1]} modes, the surface {n}")
        _check_quadratic(self.second, (count, 3), n)
        _check_quadratic(self.second_stress, (count, 6), n)
        triangles = np.array(self.triangles, dtype=np.int64).reshape(-1, 3)
        if triangles.size and (triangles.min() < 0 or triangles.max() >= count):
            raise BodyError(f"surface: a triangle refers to point {triangles.max()}, but there are {count} points")
        triangles.setflags(write=False)
        object.__setattr__(self, "triangles", triangles)


@dataclass(frozen=True, repr=False)
class FlexibleBody(Brief):
    """A linear elastic body in the floating frame of reference; ``n = 0`` is a rigid body.

    mass      : I1, [kg]
    r_dm      : (3,) integral of u_0 dm [kg m]
    rr_dm     : (3, 3) integral of u_0k u_0l dm [kg m^2]
    P_dm      : (3, n) integral of Phi dm [sqrt(kg)]
    rP_dm     : (3, 3, n) integral of u_0k phi_l,j dm at [k, l, j] [m sqrt(kg)]
    PP_dm     : (3, 3, n, n) integral of phi_k,i phi_l,j dm at [k, l, i, j] [1]
    omega2    : (n,) squared circular frequencies of the reduced body under its reference conditions [rad^2/s^2]
    interfaces, surface : where to attach, what to draw
    stiffening: (12 + 6 I, n, n) geometric stiffness [1/s^2] per unit of 12 + 6 I loads, in body axes. The first twelve: the
        acceleration of the body frame less gravity (3) [m/s^2], its angular acceleration (3) [rad/s^2], the products xx, yy,
        zz, xy, xz, yz of its angular velocity (6) [rad^2/s^2]. Then for each of the I interfaces force (3) [N] and
        semitangential moment (3) [N m]. None where it was not computed
    damping   : (n, n) symmetric damping matrix of the elastic coordinates [1/s], beside the ratios that a scene gives: from a
        finite-element model, a file, or `damped`. None where there is none
    parts     : bodies that the body is cut into, one after the other, if it is: each in the same frame, undeformed, with the
        interfaces of the whole that lie in it and those at its cuts (`cut_names`). A scene moves them in place of the whole
    provenance: how the body was made; plain JSON values

    Raises BodyError when the integrals contradict each other (shape, symmetry, orthonormality, negative mass), and for parts
    that do not make up the whole.

    >>> body = fd.load_body("rod.ffr")
    >>> np.sqrt(body.omega2) / (2 * np.pi)  # frequencies [Hz]
    """

    name: str
    mass: float
    r_dm: Array
    rr_dm: Array
    P_dm: Array
    rP_dm: Array
    PP_dm: Array
    omega2: Array
    interfaces: tuple[Interface, ...] = ()
    surface: Surface | None = None
    stiffening: Array | None = None
    provenance: Mapping[str, Any] = field(default_factory=dict)
    parts: tuple[FlexibleBody, ...] = ()
    damping: Array | None = None

    def __post_init__(self) -> None:
        n = np.size(self.omega2)
        object.__setattr__(self, "mass", float(self.mass))
        for key, shape in integral_shapes(n).items():
            _freeze(self, key, shape)
        object.__setattr__(self, "interfaces", tuple(self.interfaces))
        if self.stiffening is not None:
            _freeze(self, "stiffening", (12 + 6 * len(self.interfaces), n, n))
        if self.damping is not None:
            _freeze(self, "damping", (n, n))
            _check_damping(self.name, self.damping)
        _check(self)
        object.__setattr__(self, "parts", tuple(self.parts))
        if self.parts:
            _check_parts(self)

    def _title(self) -> str:
        return f"FlexibleBody {self.name!r}"

    def _rows(self) -> Rows:
        surface = self.surface
        holds = {
            "geometric stiffening": self.stiffening,
            "damping": self.damping,
            "surface": surface,
            "foreshortening": surface and surface.second,
            "stress": surface and surface.stress,
            "section forces": surface and surface.beams,
        }
        rows = {
            "mass": f"{self.mass:.6g} kg, centre {vector_in_words(self.centre_of_mass, self.size)} m",
            "size": f"{self.size:.5g} m",
            "modes": f"{self.n}: {listed(f'{f:.4g}' for f in self.frequencies)} Hz" if self.n else "none: rigid",
            "interfaces": listed(f"{i.name} ({i.kind})" for i in self.interfaces),
            "parts": str(len(self.parts) or ""),
            "reference": settings_in_words(self.provenance.get("reference", "")),
            "reduction": settings_in_words(self.provenance.get("reduction", "")),
            "holds": ", ".join(what for what, there in holds.items() if there is not None),
            "warnings": "; ".join(self.provenance.get("warnings", [])),
        }
        return [(name, text) for name, text in rows.items() if text]

    # ---- sizes and rigid-body quantities -------------------------------------------------------------------------

    @cached_property
    def n(self) -> int:
        """Number of elastic coordinates."""
        return int(self.omega2.size)

    @cached_property
    def size(self) -> float:
        """Largest extent of interfaces and surface along an axis of the body [m]; zero of a point."""
        if len(self.interfaces) < 2 and self.surface is None:
            return 0.0
        places = np.array([interface.position for interface in self.interfaces]).reshape(-1, 3)
        if self.surface is not None:
            places = np.concatenate([places, self.surface.points])
        return float(np.ptp(places, axis=0).max()) if len(places) else 0.0

    @property
    def frequencies(self) -> Array:
        """(n,) frequencies under the reference conditions [Hz]."""
        return np.sqrt(self.omega2) / (2 * np.pi)

    @property
    def centre_of_mass(self) -> Array:
        """(3,) undeformed centre of mass in the body frame [m]."""
        return self.r_dm / self.mass

    @property
    def inertia(self) -> Array:
        """(3, 3) undeformed inertia tensor about the origin of the body frame [kg m^2] (I7)."""
        xx, yy, zz = self.rr_dm.diagonal().tolist()
        return np.diag([xx + yy + zz] * 3) - self.rr_dm

    @property
    def central_inertia(self) -> Array:
        """(3, 3) undeformed inertia tensor about the centre of mass, body axes [kg m^2]."""
        c = self.centre_of_mass
        return self.inertia - self.mass * (c @ c * np.eye(3) - np.outer(c, c))

    def interface(self, name: str) -> Interface:
        """The interface of that name; BodyError lists the names there are."""
        for candidate in self.interfaces:
            if candidate.name == name:
                return candidate
        known = ", ".join(repr(i.name) for i in self.interfaces) or "none"
        raise BodyError(f"body {self.name!r} has no interface {name!r}; it has: {known}")

    # ---- the nine inertia invariants ------------------------------------------------------------------------------
    # Signs as in Rantalainen 2007, eqs. 3.50-3.67: J(q) = I7 - sum_j (I8_j + I8_j^T) q_j - sum_ij I9_ij q_i q_j.
    # Other sources (MBDyn among them) define I8 with the opposite sign.

    @property
    def I1(self) -> float:
        """Mass [kg]."""
        return self.mass

    @property
    def I2(self) -> Array:
        """(3,) first moment of the mass, integral of u_0 dm [kg m]."""
        return self.r_dm

    @property
    def I3(self) -> Array:
        """(3, n) integral of Phi dm [sqrt(kg)]."""
        return self.P_dm

    @property
    def I4(self) -> Array:
        """(3, n) integral of u_0 x phi_j dm [m sqrt(kg)]. Equation (6) of docs/notation.md."""
        return axial(self.rP_dm)

    @property
    def I5(self) -> Array:
        """(3, n, n) integral of phi_i x phi_j dm at [:, i, j] [1]. Equation (7) of docs/notation.md."""
        return axial(self.PP_dm)

    @property
    def I6(self) -> Array:
        """(n, n) integral of Phi^T Phi dm [1]; the identity, since the basis is mass-orthonormal."""
        return np.einsum("kkij->ij", self.PP_dm)

    @property
    def I7(self) -> Array:
        """(3, 3) undeformed inertia tensor about the origin, integral of u~^T u~ dm [kg m^2]."""
        return self.inertia

    @property
    def I8(self) -> Array:
        """(n, 3, 3) integral of u_0~ phi_j~ dm [m sqrt(kg)]. Equation (8) of docs/notation.md."""
        trace = np.einsum("kkj->j", self.rP_dm)
        return np.einsum("klj->jlk", self.rP_dm) - trace[:, None, None] * np.eye(3)

    @property
    def I9(self) -> Array:
        """(n, n, 3, 3) integral of phi_i~ phi_j~ dm at [i, j] [1]. Equation (9) of docs/notation.md."""
        trace = np.einsum("kkij->ij", self.PP_dm)
        return np.einsum("klij->ijlk", self.PP_dm) - trace[:, :, None, None] * np.eye(3)

    # ---- Shabana's inertia shape integrals (Dynamics of Multibody Systems, ch. 5 and 6), in modal coordinates -----

    @property
    def S_bar(self) -> Array:
        """(3, n) integral of the shape functions dm (= I3) [sqrt(kg)]."""
        return self.P_dm

    def S_bar_kl(self, k: int, l: int) -> Array:  # noqa: E741 - k, l are the book's indices
        """(n, n) integral of S_k^T S_l dm, with k, l in 0, 1, 2 for x, y, z [1]."""
        return self.PP_dm[k, l]

    def N_bar_kl(self, k: int, l: int) -> Array:  # noqa: E741
        """(n, n) skew part S_bar_kl - S_bar_kl^T [1]."""
        return self.PP_dm[k, l] - self.PP_dm[k, l].T

    @property
    def S_bar_ff(self) -> Array:
        """(n, n) S_bar_xx + S_bar_yy + S_bar_zz (= I6) [1]."""
        return self.I6


# ---- what follows from a body alone -------------------------------------------------------------------------------

_MEMORY = "what follows"  # no name of a field
_MOST = 64  # things of one body; then all are forgotten
T = TypeVar("T")


class _Memory(dict[Hashable, Any]):
    """Of one body, or whatever else is immutable; not kept in files, copies and messages to other processes."""

    def __reduce__(self) -> Any:
        return _Memory, ()


def remembered(body: Any, key: Hashable, make: Callable[[], T]) -> T:
    """The value of `make()`, which depends on the body and `key` alone, computed once for each.

    For what many scenes ask of one body: its forms in a plane, its tables. It lives as long as the body. Of other things that
    do not change the same may be asked.
    """
    try:
        found: T = vars(body)[_MEMORY][key]
    except KeyError:
        made, memory = make(), vars(body).setdefault(_MEMORY, _Memory())
        if len(memory) >= _MOST:
            memory.clear()
        found = memory.setdefault(key, made)  # of two threads the first
    return found


def axial(tensor: Array) -> Array:
    """(3, 3, ...) -> (3, ...): T_yz - T_zy, T_zx - T_xz, T_xy - T_yx, which is a x b for T = a b^T."""
    return np.stack([tensor[1, 2] - tensor[2, 1], tensor[2, 0] - tensor[0, 2], tensor[0, 1] - tensor[1, 0]])


def cut_names(k: int) -> tuple[str, str]:
    """The interfaces at the k-th cut of a body in parts, k from 1: that of part k and that of part k + 1, at one place."""
    return f"cut_{k}_a", f"cut_{k}_b"


# ---- guards -------------------------------------------------------------------------------------------------------


def integral_shapes(n: int) -> dict[str, tuple[int, ...]]:
    """The shapes of the arrays that every body has, by name."""
    return {
        "r_dm": (3,),
        "rr_dm": (3, 3),
        "P_dm": (3, n),
        "rP_dm": (3, 3, n),
        "PP_dm": (3, 3, n, n),
        "omega2": (n,),
    }


def _freeze(owner: Any, key: str, shape: tuple[int, ...]) -> None:
    value = np.array(getattr(owner, key), dtype=np.float64)
    if value.shape != shape:
        raise BodyError(f"{type(owner).__name__}: {key} has shape {value.shape}, not {shape}")
    if not np.isfinite(value).all():
        raise BodyError(f"{type(owner).__name__}: {key} holds values that are not finite")
    value.setflags(write=False)
    object.__setattr__(owner, key, value)


def _check_quadratic(field: QuadraticField | None, places: tuple[int, ...], n: int) -> None:
    if field is None or (field.shapes.shape[:-1] == places and field.weights.shape[1] == n):
        return
    raise BodyError(
        f"a quadratic field of {field.shapes.shape[:-1]} values in {field.weights.shape[1]} modes does not fit "
        f"{places} values in {n} modes"
    )


def _check(body: FlexibleBody) -> None:
    if not (np.isfinite(body.mass) and body.mass > 0):
        raise BodyError(f"body {body.name!r}: mass is {body.mass} kg; it must be positive")
    names = [i.name for i in body.interfaces]
    repeated = [name for k, name in enumerate(names) if name in names[:k]]
    if repeated:
        raise BodyError(
            f"body {body.name!r}: interface names repeat: {repeated[0]!r} is there more than once in {names}; each needs "
            "a name of its own"
        )
    if body.omega2.size and body.omega2.min() < 0:
        raise BodyError(f"body {body.name!r}: omega2 has the negative value {body.omega2.min():g}")
    parts = [i.phi_t for i in body.interfaces] + ([body.surface.Phi] if body.surface else [])
    if any(part.shape[-1] != body.n for part in parts):
        raise BodyError(f"body {body.name!r}: interfaces or surface do not have {body.n} modes")
    off = np.abs(body.I6 - np.eye(body.n)).max(initial=0.0)
    if off > _ORTHONORMAL_TOLERANCE:
        raise BodyError(f"body {body.name!r}: the basis is not mass-orthonormal (off by {off:.1e})")
    off = np.abs(body.PP_dm - body.PP_dm.transpose(1, 0, 3, 2)).max(initial=0.0)
    if off > _ORTHONORMAL_TOLERANCE:
        raise BodyError(f"body {body.name!r}: PP_dm[l, k] is not PP_dm[k, l]^T (off by {off:.1e})")
    second = body.rr_dm - np.outer(body.r_dm, body.r_dm) / body.mass
    scale = np.abs(body.rr_dm).max()
    if np.abs(second - second.T).max() > 1e-10 * scale or np.linalg.eigvalsh(second).min() < -1e-10 * scale:
        moments = np.linalg.eigvalsh(body.central_inertia)
        raise BodyError(
            f"body {body.name!r}: no mass distribution has the principal moments of inertia {moments} kg m^2 "
            "(each must be at most the sum of the other two)"
        )


def _check_damping(name: str, D: Array) -> None:
    largest = np.abs(D).max(initial=0.0)
    if np.abs(D - D.T).max(initial=0.0) > _ORTHONORMAL_TOLERANCE * largest:
        raise BodyError(f"body {name!r}: its damping matrix is not symmetric")
    if largest and (least := np.linalg.eigvalsh(D)[0]) < -_ORTHONORMAL_TOLERANCE * largest:
        raise BodyError(
            f"body {name!r}: its damping matrix has the eigenvalue {least:.3g} 1/s, which would feed vibration"
        )


def _check_parts(body: FlexibleBody) -> None:
    """Parts have the mass and the interfaces of the whole, and meet at their cuts."""
    names = [interface.name for part in body.parts for interface in part.interfaces]
    cuts = [name for k in range(1, len(body.parts)) for name in cut_names(k)]
    if sorted(names) != sorted([*cuts, *(i.name for i in body.interfaces)]):
        raise BodyError(
            f"body {body.name!r}: its parts have the interfaces {names}; they must be those of the whole, each once, and "
            f"those of the cuts: {cuts}"
        )
    mass = sum(part.mass for part in body.parts)
    if abs(mass - body.mass) > _PARTS_TOLERANCE * body.mass or any(part.parts for part in body.parts):
        raise BodyError(f"body {body.name!r}: its parts have {mass:.9g} kg together, the whole {body.mass:.9g} kg")
    for k, (one, other) in enumerate(pairwise(body.parts), 1):
        a, b = cut_names(k)
        apart = np.abs(one.interface(a).position - other.interface(b).position).max()
        if apart > _PARTS_TOLERANCE * max(body.size, one.size):
            raise BodyError(f"body {body.name!r}: parts {k} and {k + 1} are {apart:.3g} m apart at their cut")
