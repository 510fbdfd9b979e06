"""The reduced flexible body: the one object that passes from `ffr_prep` to `ffr_dyn`.

A body is a small, immutable set of arrays: inertia integrals over the mass, modal frequencies, interfaces with
their mode shapes, and a surface to draw. This module imports numpy and the standard library only, so a simulation
needs neither a mesher nor a finite-element library.

Notation (SI units): the position of a material point in the body frame is  u_bar = u_0 + Phi q,  with the undeformed
position u_0 [m], the mass-orthonormal basis Phi (Phi^T M Phi = I, Phi^T K Phi = diag(omega2)) and the elastic
coordinates q (n,) [m sqrt(kg)]. Integrals over the mass carry the suffix ``_dm``; their integrand is their name.
The numbered invariants I1...I9 and Shabana's S_bar family are read-only views of these integrals.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

Array = np.ndarray

MAGIC = "ffr-body"
FORMAT_VERSION = 2  # 2 adds stress modes and section forces; files of version 1 are read as bodies without them

_ORTHONORMAL_TOLERANCE = 1e-8


class BodyError(ValueError):
    """A body or a body file that cannot be used; the message says what is wrong and what to do."""


@dataclass(frozen=True)
class Interface:
    """A six-coordinate node to which joints, forces and sensors attach.

    position : (3,) [m], undeformed, in the body frame
    phi_t    : (3, n) [1/sqrt(kg)], translation of the node per elastic coordinate
    phi_r    : (3, n) [rad/(m sqrt(kg))], infinitesimal rotation of the node per elastic coordinate
    kind     : "rigid" (RBE2), "mean" (RBE3) or "node"
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


@dataclass(frozen=True)
class BeamForces:
    """Section forces of E beam elements per elastic coordinate, at the first end, the middle and the last end of each.

    positions : (E, 3, 3) undeformed places on the centroid line, in the body frame [m]
    axes      : (E, 3, 3) rotation from element to body axes
    modes     : (E, 3, 6, n) N, Qy, Qz, Mx, My, Mz at [element, place, force, :], which the part of the beam towards the
                last end exerts on the other, in element axes [N/(m sqrt(kg)), N/sqrt(kg)]
    """

    positions: Array
    axes: Array
    modes: Array

    def __post_init__(self) -> None:
        count, n = np.shape(self.positions)[0], np.shape(self.modes)[-1]
        _freeze(self, "positions", (count, 3, 3))
        _freeze(self, "axes", (count, 3, 3))
        _freeze(self, "modes", (count, 3, 6, n))


@dataclass(frozen=True)
class Surface:
    """What is drawn and where fields are recovered: a triangulated boundary with the basis at its points.

    points : (P, 3) [m] undeformed; triangles : (T, 3) indices into points; Phi : (P, 3, n) [1/sqrt(kg)]
    stress : (P, 6, n) components xx, yy, zz, xy, xz, yz of the stress per elastic coordinate, in body axes
             [Pa/(m sqrt(kg))]; None where it was not recovered
    moduli : (P, 2) Young's modulus [Pa] and Poisson's ratio at the points, which give the strain; with the stress
    beams  : section forces of beam elements; None where there are none
    """

    points: Array
    triangles: Array
    Phi: Array
    stress: Array | None = None
    moduli: Array | None = None
    beams: BeamForces | None = None

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
        triangles = np.array(self.triangles, dtype=np.int64).reshape(-1, 3)
        if triangles.size and (triangles.min() < 0 or triangles.max() >= count):
            raise BodyError(f"surface: a triangle refers to point {triangles.max()}, but there are {count} points")
        triangles.setflags(write=False)
        object.__setattr__(self, "triangles", triangles)


@dataclass(frozen=True)
class FlexibleBody:
    """A linear elastic body in the floating frame of reference; ``n = 0`` is a rigid body.

    mass      : I1, [kg]
    r_dm      : (3,) integral of u_0 dm [kg m]
    rr_dm     : (3, 3) integral of u_0k u_0l dm [kg m^2]
    P_dm      : (3, n) integral of Phi dm [sqrt(kg)]
    rP_dm     : (3, 3, n) integral of u_0k phi_l,j dm at [k, l, j] [m sqrt(kg)]
    PP_dm     : (3, 3, n, n) integral of phi_k,i phi_l,j dm at [k, l, i, j] [-]
    omega2    : (n,) squared circular frequencies of the reduced body under its reference conditions [rad^2/s^2]
    interfaces, surface : where to attach, what to draw
    stiffening: (12 + 6 I, n, n) geometric stiffness [1/s^2] per unit of: the acceleration of the body frame less gravity
        (3) [m/s^2], its angular acceleration (3) [rad/s^2], the products xx, yy, zz, xy, xz, yz of its angular velocity
        (6) [rad^2/s^2], and for each of the I interfaces force (3) [N] and moment (3) [N m]; all in body axes. None where
        it was not computed
    provenance: how the body was made; plain JSON values

    Raises BodyError when the integrals contradict each other (shape, symmetry, orthonormality, negative mass).
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

    def __post_init__(self) -> None:
        n = np.size(self.omega2)
        object.__setattr__(self, "mass", float(self.mass))
        for key, shape in _shapes(n).items():
            _freeze(self, key, shape)
        object.__setattr__(self, "interfaces", tuple(self.interfaces))
        if self.stiffening is not None:
            _freeze(self, "stiffening", (12 + 6 * len(self.interfaces), n, n))
        _check(self)

    # ---- sizes and rigid-body quantities -------------------------------------------------------------------------

    @property
    def n(self) -> int:
        """Number of elastic coordinates."""
        return int(self.omega2.size)

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
        return np.trace(self.rr_dm) * np.eye(3) - self.rr_dm

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

    def with_reference(self, conditions: Any) -> FlexibleBody:
        """The body in the frame of other reference conditions (`ffr_prep.reference`), without its finite-element model.

        Raises InputError where they do not fit the body: see `ffr_prep.conversion.with_reference`, which does the work and
        is loaded for it, since the rest of this module needs numpy only.
        """
        from ffr_prep.conversion import with_reference

        return with_reference(self, conditions)

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
        """(3, n) integral of u_0 x phi_j dm [m sqrt(kg)]."""
        return axial(self.rP_dm)

    @property
    def I5(self) -> Array:
        """(3, n, n) integral of phi_i x phi_j dm at [:, i, j] [-]."""
        return axial(self.PP_dm)

    @property
    def I6(self) -> Array:
        """(n, n) integral of Phi^T Phi dm [-]; the identity, since the basis is mass-orthonormal."""
        return np.einsum("kkij->ij", self.PP_dm)

    @property
    def I7(self) -> Array:
        """(3, 3) undeformed inertia tensor about the origin, integral of u~^T u~ dm [kg m^2]."""
        return self.inertia

    @property
    def I8(self) -> Array:
        """(n, 3, 3) integral of u_0~ phi_j~ dm [m sqrt(kg)]."""
        trace = np.einsum("kkj->j", self.rP_dm)
        return np.einsum("klj->jlk", self.rP_dm) - trace[:, None, None] * np.eye(3)

    @property
    def I9(self) -> Array:
        """(n, n, 3, 3) integral of phi_i~ phi_j~ dm at [i, j] [-]."""
        trace = np.einsum("kkij->ij", self.PP_dm)
        return np.einsum("klij->ijlk", self.PP_dm) - trace[:, :, None, None] * np.eye(3)

    # ---- Shabana's inertia shape integrals (Dynamics of Multibody Systems, ch. 5 and 6), in modal coordinates -----

    @property
    def S_bar(self) -> Array:
        """(3, n) integral of the shape functions dm (= I3) [sqrt(kg)]."""
        return self.P_dm

    def S_bar_kl(self, k: int, l: int) -> Array:  # noqa: E741 - k, l are the book's indices
        """(n, n) integral of S_k^T S_l dm, with k, l in 0, 1, 2 for x, y, z [-]."""
        return self.PP_dm[k, l]

    def N_bar_kl(self, k: int, l: int) -> Array:  # noqa: E741
        """(n, n) skew part S_bar_kl - S_bar_kl^T [-]."""
        return self.PP_dm[k, l] - self.PP_dm[k, l].T

    @property
    def S_bar_ff(self) -> Array:
        """(n, n) S_bar_xx + S_bar_yy + S_bar_zz (= I6) [-]."""
        return self.I6


def axial(tensor: Array) -> Array:
    """(3, 3, ...) -> (3, ...): T_yz - T_zy, T_zx - T_xz, T_xy - T_yx, which is a x b for T = a b^T."""
    return np.stack([tensor[1, 2] - tensor[2, 1], tensor[2, 0] - tensor[0, 2], tensor[0, 1] - tensor[1, 0]])


# ---- making bodies ------------------------------------------------------------------------------------------------


def rigid_body(
    name: str,
    *,
    mass: float,
    inertia: Array,
    centre_of_mass: Array = (0.0, 0.0, 0.0),  # type: ignore[assignment]
    points: Mapping[str, Array] | None = None,
    surface: Surface | None = None,
) -> FlexibleBody:
    """A body without elastic coordinates.

    mass [kg]; inertia (3, 3) or its diagonal (3,) about the centre of mass, in body axes [kg m^2]; centre_of_mass (3,)
    [m] in the body frame; points: named points (3,) [m] in the body frame at which joints and forces may attach.
    Raises BodyError for a mass that is not positive, or an inertia that no mass distribution can have.
    """
    tensor = np.asarray(inertia, float)
    tensor = np.diag(tensor) if tensor.ndim == 1 else tensor
    if tensor.shape != (3, 3):
        raise BodyError(f"body {name!r}: inertia must be (3,) or (3, 3), not {np.shape(inertia)}")
    c = np.asarray(centre_of_mass, float)
    about_origin = tensor + mass * (c @ c * np.eye(3) - np.outer(c, c))
    nothing = np.zeros((3, 0))
    return FlexibleBody(
        name=name,
        mass=mass,
        r_dm=mass * c,
        rr_dm=0.5 * np.trace(about_origin) * np.eye(3) - about_origin,
        P_dm=nothing,
        rP_dm=np.zeros((3, 3, 0)),
        PP_dm=np.zeros((3, 3, 0, 0)),
        omega2=np.zeros(0),
        interfaces=tuple(Interface(key, at, nothing, nothing) for key, at in (points or {}).items()),
        surface=surface,
        provenance={"kind": "rigid"},
    )


def truncated(body: FlexibleBody, modes: int | Array) -> FlexibleBody:
    """The body with only its first ``modes`` elastic coordinates, or those whose indices are listed.

    Raises BodyError for a mode that does not exist or is listed twice.
    """
    keep = np.arange(int(modes)) if np.ndim(modes) == 0 else np.asarray(modes, int)
    unknown = keep[(keep < 0) | (keep >= body.n)]
    if unknown.size or np.unique(keep).size < keep.size:
        raise BodyError(
            f"body {body.name!r} has {body.n} modes, counted from 0; asked to keep {keep.tolist()}: each must exist "
            "and be named once"
        )
    return replace(
        body,
        P_dm=body.P_dm[:, keep],
        rP_dm=body.rP_dm[:, :, keep],
        PP_dm=body.PP_dm[:, :, keep][:, :, :, keep],
        omega2=body.omega2[keep],
        interfaces=tuple(replace(i, phi_t=i.phi_t[:, keep], phi_r=i.phi_r[:, keep]) for i in body.interfaces),
        surface=body.surface and recombined(body.surface, np.eye(body.n)[:, keep], body.surface.Phi[:, :, keep]),
        stiffening=None if body.stiffening is None else body.stiffening[:, keep][:, :, keep],
    )


def recombined(surface: Surface, V: Array, Phi: Array) -> Surface:
    """The surface for other elastic coordinates p, with q = V p for V (n, m) and the basis Phi (P, 3, m).

    Phi may differ from the old basis times V by rigid motions, which cause no stress.
    """
    stress = None if surface.stress is None else surface.stress @ V
    beams = surface.beams and replace(surface.beams, modes=surface.beams.modes @ V)
    return replace(surface, Phi=Phi, stress=stress, beams=beams)


def with_point(body: FlexibleBody, name: str, position: Array) -> FlexibleBody:
    """The body with one more interface, at the surface node nearest to `position` (3,) [m], body frame.

    Joints, forces and sensors can then attach there. Its rotation is the least-squares rotation of the node's
    neighbours on the surface. Nothing is added to the basis: what the node does under load is what the basis can show;
    loads there do not stiffen the body.

    Raises BodyError when the body has no surface.
    """
    if body.surface is None:
        raise BodyError(f"body {body.name!r} has no surface to put the point {name!r} on")
    points, Phi = body.surface.points, body.surface.Phi
    node = int(np.argmin(((points - np.asarray(position, float)) ** 2).sum(1)))
    here = np.flatnonzero((points == points[node]).all(1))  # points are there twice where materials meet
    around = body.surface.triangles[np.isin(body.surface.triangles, here).any(1)]
    ring = np.setdiff1d(around, here)
    ring = ring[np.sort(np.unique(points[ring], axis=0, return_index=True)[1])]
    arms, moved = points[ring] - points[node], Phi[ring] - Phi[node]
    # omega minimises sum |omega x arm - moved|^2, so (sum arm^2 I - arm arm^T) omega = sum arm x moved
    normal = (arms**2).sum() * np.eye(3) - arms.T @ arms
    phi_r = np.linalg.lstsq(normal, axial(np.einsum("pk,plj->klj", arms, moved)), rcond=None)[0]
    stiffening = body.stiffening
    if stiffening is not None:
        stiffening = np.concatenate([stiffening, np.zeros((6, body.n, body.n))])
    point = Interface(name, points[node], Phi[node], phi_r)
    return replace(body, interfaces=(*body.interfaces, point), stiffening=stiffening)


# ---- the body file ------------------------------------------------------------------------------------------------
# A zip of .npy members (numpy's .npz, readable without this package) and one JSON member "meta". No pickle.


def save_body(body: FlexibleBody, path: str | Path) -> Path:
    """Write the body to one file, atomically: an existing file is replaced only by a complete new one.

    Raises BodyError when the provenance is not JSON, OSError when the file cannot be written.
    """
    path = Path(path)
    arrays = {key: getattr(body, key) for key in _shapes(body.n)}
    for k, interface in enumerate(body.interfaces):
        for key in ("position", "phi_t", "phi_r"):
            arrays[f"interface/{k}/{key}"] = getattr(interface, key)
    if body.surface is not None:
        arrays |= {f"surface/{key}": value for key, value in surface_arrays(body.surface).items()}
    if body.stiffening is not None:
        arrays["stiffening"] = body.stiffening
    meta = {
        "magic": MAGIC,
        "format_version": FORMAT_VERSION,
        "name": body.name,
        "mass": body.mass,
        "interfaces": [{"name": i.name, "kind": i.kind} for i in body.interfaces],
        "provenance": dict(body.provenance),
    }
    arrays["meta"] = np.frombuffer(_header(body, meta).encode(), dtype=np.uint8)
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(path.name + ".part")
    try:
        with open(temporary, "wb") as stream:
            np.savez_compressed(stream, **arrays)
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)
    return path


def surface_arrays(surface: Surface) -> dict[str, Array]:
    """The arrays of a surface by name, without those it does not have: how files keep it."""
    arrays = {"points": surface.points, "triangles": surface.triangles, "Phi": surface.Phi}
    if surface.stress is not None and surface.moduli is not None:
        arrays |= {"stress": surface.stress, "moduli": surface.moduli}
    if surface.beams is not None:
        arrays |= {f"beams/{f.name}": getattr(surface.beams, f.name) for f in fields(BeamForces)}
    return arrays


def surface_of(arrays: Mapping[str, Array]) -> Surface:
    """The surface of these arrays; the inverse of `surface_arrays`."""
    own = {key: value for key, value in arrays.items() if "/" not in key}
    beams = {key.removeprefix("beams/"): value for key, value in arrays.items() if key.startswith("beams/")}
    return Surface(**own, beams=BeamForces(**beams) if beams else None)


def load_body(path: str | Path) -> FlexibleBody:
    """Read a body file. Raises BodyError for a missing, damaged, truncated, foreign or newer file."""
    path = Path(path)
    try:
        return _from_arrays(*_read(path))
    except FileNotFoundError:
        raise BodyError(f"body file {path} does not exist") from None
    except (PermissionError, IsADirectoryError) as error:
        raise BodyError(f"body file {path} cannot be read ({error.strerror})") from None
    except BodyError as error:
        raise BodyError(f"{path}: {error}") from None
    except Exception as error:  # a damaged zip, array header or field can fail in any way the readers know
        what = str(error) or type(error).__name__
        raise BodyError(
            f"{path} is damaged, truncated or not a body file ({what}); make it again with ffr-prep reduce"
        ) from None


def content_hash(*arrays: Array) -> str:
    """Short SHA-256 of array contents, for provenance."""
    digest = hashlib.sha256()
    for array in arrays:
        digest.update(str((array.shape, array.dtype.str)).encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()[:16]


def _header(body: FlexibleBody, meta: Mapping[str, Any]) -> str:
    try:
        return json.dumps(meta, sort_keys=True)
    except (TypeError, ValueError) as error:
        raise BodyError(f"body {body.name!r}: the provenance must be plain JSON values ({error})") from None


def _read(path: Path) -> tuple[dict[str, Any], dict[str, Array]]:
    stored = np.load(path, allow_pickle=False)
    if not isinstance(stored, np.lib.npyio.NpzFile):
        raise BodyError("not a body file (a bare array); write one with ffr-prep reduce")
    with stored:
        meta = _meta(stored)
        return meta, {key: stored[key] for key in stored.files if key != "meta"}


def _meta(stored: Any) -> dict[str, Any]:
    if "meta" not in stored.files:
        raise BodyError("not a body file (it has no header); write one with ffr-prep reduce")
    meta = json.loads(stored["meta"].tobytes())
    if not isinstance(meta, dict) or meta.get("magic") != MAGIC:
        raise BodyError("not a body file (foreign header); write one with ffr-prep reduce")
    if meta["format_version"] > FORMAT_VERSION:
        raise BodyError(
            f"body format {meta['format_version']}; this program reads up to {FORMAT_VERSION}: update the program"
        )
    return meta


def _from_arrays(meta: Mapping[str, Any], arrays: Mapping[str, Array]) -> FlexibleBody:
    interfaces = tuple(
        Interface(
            entry["name"],
            arrays[f"interface/{k}/position"],
            arrays[f"interface/{k}/phi_t"],
            arrays[f"interface/{k}/phi_r"],
            entry["kind"],
        )
        for k, entry in enumerate(meta["interfaces"])
    )
    of_surface = {key.removeprefix("surface/"): value for key, value in arrays.items() if key.startswith("surface/")}
    surface = surface_of(of_surface) if of_surface else None
    core = {key: arrays[key] for key in _shapes(arrays["omega2"].size)}
    return FlexibleBody(
        name=meta["name"],
        mass=meta["mass"],
        interfaces=interfaces,
        surface=surface,
        stiffening=arrays.get("stiffening"),
        provenance=meta["provenance"],
        **core,
    )


# ---- guards -------------------------------------------------------------------------------------------------------


def _shapes(n: int) -> dict[str, tuple[int, ...]]:
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


def _check(body: FlexibleBody) -> None:
    if not (np.isfinite(body.mass) and body.mass > 0):
        raise BodyError(f"body {body.name!r}: mass is {body.mass} kg; it must be positive")
    names = [i.name for i in body.interfaces]
    if len(set(names)) < len(names):
        raise BodyError(f"body {body.name!r}: interface names repeat: {names}")
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
