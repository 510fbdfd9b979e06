"""The inertia integrals of a frame of beams and plates in its nodal coordinates q_n, before any reduction.

With the displacement u = N q_n, N = C S C_bar B_1 (three translations and three rotations of every node), they are the
inertia shape integrals of the books, over the same mass points from which a body's are summed: with q_n = B_2 q_f those of
the body follow (S_bar B_2, B_2^T S_bar_kl B_2, ...). Names and signs are those of `ffr_prep.body.FlexibleBody`.

Source: A. A. Shabana, Dynamics of Multibody Systems (2013), sections 5.3 and 6.5.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from ffr_prep.body import axial
from ffr_prep.common.arrays import Array
from ffr_prep.common.brief import Brief, Rows
from ffr_prep.structures.element_families import Family, connectivity, families
from ffr_prep.structures.frame import Frame, check_frame

Matrices = tuple[tuple[sp.csr_array, ...], ...]


@dataclass(frozen=True, repr=False)
class NodalIntegrals(Brief):
    """Integrals over the mass in the nodal coordinates q_n (6N,): translations [m] and rotations [rad] of N nodes.

    q_0   : (6N,) coordinates of the undeformed frame, N q_0 = u_0 on the lines and planes that the nodes span
    mass  : [kg];  r_dm : (3,) integral of u_0 dm [kg m];  rr_dm : (3, 3) integral of u_0k u_0l dm [kg m^2]
    P_dm  : (3, 6N) integral of N dm [kg, kg m]
    rP_dm : (3, 3, 6N) integral of u_0k N_l dm at [k, l] [kg m, kg m^2]
    PP_dm : (3, 3) sparse matrices (6N, 6N), integrals of N_k^T N_l dm at [k][l] [kg, kg m, kg m^2]

    >>> integrals = fp.nodal_integrals(frame)
    """

    q_0: Array
    mass: float
    r_dm: Array
    rr_dm: Array
    P_dm: Array
    rP_dm: Array
    PP_dm: Matrices

    def _rows(self) -> Rows:
        return [("mass", f"{self.mass:.6g} kg"), ("coordinates", str(self.q_0.size))]

    @property
    def I1(self) -> float:
        """Mass [kg]."""
        return self.mass

    @property
    def I2(self) -> Array:
        """(3,) first moment of the mass."""
        return self.r_dm

    @property
    def I3(self) -> Array:
        """(3, 6N) integral of N dm."""
        return self.P_dm

    @property
    def I4(self) -> Array:
        """(3, 6N) integral of u_0 x N_j dm."""
        return axial(self.rP_dm)

    @property
    def I5(self) -> tuple[sp.csr_array, ...]:
        """Three skew matrices (6N, 6N), the components of the integral of N_i x N_j dm."""
        return tuple(self.N_bar_kl(*pair) for pair in ((1, 2), (2, 0), (0, 1)))

    @property
    def I6(self) -> sp.csr_array:
        """(6N, 6N) integral of N^T N dm, the mass matrix of the nodal coordinates."""
        return sp.csr_array(self.PP_dm[0][0] + self.PP_dm[1][1] + self.PP_dm[2][2])

    @property
    def I7(self) -> Array:
        """(3, 3) undeformed inertia tensor about the origin [kg m^2]."""
        return np.trace(self.rr_dm) * np.eye(3) - self.rr_dm

    @property
    def I8(self) -> Array:
        """(6N, 3, 3) integral of u_0~ N_j~ dm."""
        trace = np.einsum("kkj->j", self.rP_dm)
        return np.einsum("klj->jlk", self.rP_dm) - trace[:, None, None] * np.eye(3)

    @property
    def I9(self) -> Matrices:
        """(3, 3) matrices (6N, 6N), integrals of N_i~ N_j~ dm."""
        return tuple(
            tuple(sp.csr_array(row[k] - self.I6) if k == at else row[k] for at, row in enumerate(self.PP_dm))
            for k in range(3)
        )

    @property
    def S_bar(self) -> Array:
        """(3, 6N) integral of the shape functions dm (= I3)."""
        return self.P_dm

    def S_bar_kl(self, k: int, l: int) -> sp.csr_array:  # noqa: E741 - k, l are the book's indices
        """(6N, 6N) integral of N_k^T N_l dm, with k, l in 0, 1, 2 for x, y, z."""
        return self.PP_dm[k][l]

    def N_bar_kl(self, k: int, l: int) -> sp.csr_array:  # noqa: E741
        """(6N, 6N) skew part S_bar_kl - S_bar_kl^T."""
        return sp.csr_array(self.PP_dm[k][l] - self.PP_dm[k][l].T)

    @property
    def S_bar_ff(self) -> sp.csr_array:
        """(6N, 6N) S_bar_xx + S_bar_yy + S_bar_zz (= I6)."""
        return self.I6


def nodal_integrals(frame: Frame) -> NodalIntegrals:
    """The inertia integrals of a frame in its nodal coordinates.

    Raises InputError for a frame that cannot be used.

    >>> mass = fp.nodal_integrals(frame).mass
    """
    check_frame(frame)
    parts, count = families(frame), len(frame.points)
    positions = [part.positions.reshape(-1, 3) for part in parts]
    masses = [part.mass.ravel() for part in parts]
    moments = [m[:, None] * at for m, at in zip(masses, positions, strict=True)]
    linear = [_linear(part, connectivity(part.nodes, count)) for part in parts]
    return NodalIntegrals(
        q_0=np.hstack([frame.points, np.zeros((count, 3))]).ravel(),
        mass=float(sum(m.sum() for m in masses)),
        r_dm=np.sum([moment.sum(axis=0) for moment in moments], axis=0),
        rr_dm=np.sum([at.T @ moment for at, moment in zip(positions, moments, strict=True)], axis=0),
        P_dm=np.sum([P for P, _ in linear], axis=0),
        rP_dm=np.sum([rP for _, rP in linear], axis=0),
        PP_dm=tuple(tuple(_quadratic(parts, count, k, other) for other in range(3)) for k in range(3)),
    )


def _linear(part: Family, B_1: sp.csr_array) -> tuple[Array, Array]:
    """(3, 6N) integral of N and (3, 3, 6N) integral of u_0k N_l over a family."""
    weights = np.concatenate([np.ones((*part.mass.shape, 1)), part.positions], axis=2) * part.mass[..., None]
    of_elements = np.einsum("epw,epla->wlea", weights, part.field, optimize=True)
    found = (B_1.T @ of_elements.reshape(12, -1).T).T.reshape(4, 3, -1)
    return found[0], found[1:]


def _quadratic(parts: tuple[Family, ...], count: int, k: int, l: int) -> sp.csr_array:  # noqa: E741
    """(6N, 6N) integral of N_k^T N_l over all families."""
    total = sp.csr_array((6 * count, 6 * count))
    for part in parts:
        B_1 = connectivity(part.nodes, count)
        blocks = np.einsum("epa,ep,epb->eab", part.field[:, :, k], part.mass, part.field[:, :, l], optimize=True)
        total = total + B_1.T @ sp.csr_array(sp.block_diag([sp.coo_array(block) for block in blocks])) @ B_1
    return sp.csr_array(total)
