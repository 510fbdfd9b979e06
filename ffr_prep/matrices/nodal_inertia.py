"""The inertia integrals of a body of which only the nodal mass matrix M is known.

Nothing but M says how the mass moves between the nodes, so the integrals are those products with M that they stand
for. Three routes, from exact to approximate:

1. M = m (x) I_3, as of displacement-based solids and of lumped point masses: position and modes are fields of the same
   scalar mass, and `ffr_prep.model.invariants.inertia_integrals` is exact.
2. Otherwise the six rigid motions T of the nodes, rotations included, still give exactly what they meet once:
   T^T M T is the mass, r_dm and the inertia tensor with all rotary inertia; T^T M Phi is P_dm and the axial part of
   rP_dm, the angular momentum of each mode; Phi^T M Phi = I.
3. What is left, the symmetric part of rP_dm and PP_dm, says how the inertia changes with the deformation. It follows
   from the kinetic energy of the deformed nodes turning with the frame: the nodal velocity of a unit angular velocity
   about axis a is V_a = T_a + E_a Phi q, where E_a turns the nodal vectors, translations and rotations alike, by
   e_a x. Then J(q)[a, b] = V_a^T M V_b, and W = tr(J)/2 I - J is the second moment of which rP_dm and PP_dm are the
   coefficients.

Route 3 is exact when M commutes with rotations of all nodal vectors, E_a^T M + M E_a = 0, as m (x) I_3 does. Where it
does not (the M of a beam knows the direction of the beam) three terms appear that no mass distribution has, and they
are projected away: the part of phi_i^T E_a^T M phi_j that is symmetric in i and j, the difference of the trace of
PP_dm from I, and the difference of T^T M E_a Phi from P_dm and from the exact axial part of rP_dm. Their size is
returned as the *defect* of each mode; it is of the order of the squares of (cross-section / wavelength) and
(element / wavelength).

Sources: A. A. Shabana, Dynamics of Multibody Systems (2013), sections 5.3 and 6.5; O. Wallrapp, Mechanics of
Structures and Machines 22 (1994) 283-304 (nodal form of the standard input data).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from ffr_prep.body import axial
from ffr_prep.common.arrays import Array
from ffr_prep.model.invariants import InertiaIntegrals, from_inertia, inertia_integrals, skew
from ffr_prep.structures.interfaces import rigid_coordinates

_SCALAR = 1e-9


@dataclass(frozen=True)
class DofMap:
    """Which row of a matrix is which coordinate of which node.

    nodes      : (D,) index of the node
    components : (D,) 0, 1, 2 translation along x, y, z; 3, 4, 5 rotation about x, y, z
    count      : number of nodes N; every one has its three translations
    """

    nodes: Array
    components: Array
    count: int

    def on_nodes(self, rows: Array) -> Array:
        """(D, ...) -> (N, 6, ...): coordinates that a node does not have are zero."""
        full = np.zeros((self.count, 6, *rows.shape[1:]))
        full[self.nodes, self.components] = rows
        return full

    def of_nodes(self, full: Array) -> Array:
        """(N, 6, ...) -> (D, ...): coordinates that a node does not have are left out."""
        return full[self.nodes, self.components]

    def translations(self) -> Array:
        """(N, 3) the rows of the translations."""
        rows = np.full((self.count, 6), -1, np.int64)
        rows[self.nodes, self.components] = np.arange(len(self.nodes))
        return rows[:, :3]


def rigid_motions(points: Array, dofs: DofMap) -> Array:
    """T (D, 6): three translations and three rotations about the origin of the nodes at points (N, 3) [m]."""
    return dofs.of_nodes(rigid_coordinates(points))


# ---- route 1 ------------------------------------------------------------------------------------------------------


def scalar_mass(M: sp.csr_array, dofs: DofMap) -> sp.csr_array | None:
    """m (N, N) [kg] where M = m (x) I_3 on the translations and nothing on the rotations; None for another M."""
    rows = dofs.translations()
    blocks = [[M[rows[:, k]][:, rows[:, l]] for l in range(3)] for k in range(3)]  # noqa: E741
    m = sp.csr_array((blocks[0][0] + blocks[1][1] + blocks[2][2]) / 3)
    allowed = _SCALAR * abs(m).max()
    apart = [abs(blocks[k][l] - (m if k == l else 0 * m)).max() for k in range(3) for l in range(3)]  # noqa: E741
    of_rotations = abs(M[np.flatnonzero(dofs.components >= 3)])
    coupled = of_rotations.max() if of_rotations.nnz else 0.0
    return m if max(*apart, coupled) <= allowed else None


def scalar_integrals(points: Array, dofs: DofMap, m: sp.csr_array, Phi: Array) -> InertiaIntegrals:
    """The exact integrals for the modes Phi (D, n) and the scalar mass m (N, N)."""
    return inertia_integrals(points, m, dofs.on_nodes(Phi)[:, :3])


# ---- routes 2 and 3 -----------------------------------------------------------------------------------------------


def nodal_integrals(points: Array, dofs: DofMap, M: sp.csr_array, Phi: Array) -> tuple[InertiaIntegrals, Array]:
    """The integrals of a general M (D, D) for mass-orthonormal modes Phi (D, n), and the defect (n,) of each mode."""
    T = rigid_motions(points, dofs)
    momenta, turned = M @ Phi, [_turned(axis, Phi, dofs) for axis in np.eye(3)]
    M_turned = [M @ field for field in turned]
    rigid = T.T @ (M @ T)
    coupling = T.T @ momenta
    on_turned = np.stack([T.T @ field for field in M_turned], axis=1)
    spin = np.stack([field.T @ momenta for field in turned])
    squares = np.stack([[a.T @ b for b in M_turned] for a in turned])
    gram = Phi.T @ momenta
    rr = from_inertia(rigid[3:, 3:])
    integrals = InertiaIntegrals(
        mass=float(np.trace(rigid[:3, :3]) / 3),
        r_dm=axial(rigid[:3, 3:]) / 2,
        rr_dm=(rr + rr.T) / 2,
        P_dm=coupling[:3],
        rP_dm=_symmetric_first(on_turned[3:]) - skew(coupling[3:]) / 2,
        PP_dm=_symmetric_second(squares, gram) - skew(spin - spin.transpose(0, 2, 1)) / 4,
    )
    return integrals, _defect(integrals, on_turned, spin, squares, gram)


def _turned(axis: Array, Phi: Array, dofs: DofMap) -> Array:
    """E_a Phi (D, n): axis x the translations and axis x the rotations of every node."""
    halves = dofs.on_nodes(Phi).reshape(dofs.count, 2, 3, -1)
    tilde = np.cross(axis, np.eye(3)).T
    return dofs.of_nodes(np.einsum("kl,nhlj->nhkj", tilde, halves).reshape(dofs.count, 6, -1))


def _symmetric_first(on_turned: Array) -> Array:
    """(3, 3, n) the symmetric part of rP_dm, from T_a^T M E_b phi_j at [a, b, j]."""
    return from_inertia(on_turned + on_turned.transpose(1, 0, 2)) / 2


def _symmetric_second(squares: Array, gram: Array) -> Array:
    """(3, 3, n, n) the symmetric part of PP_dm, its trace being Phi^T M Phi (n, n)."""
    W = from_inertia((squares + squares.transpose(1, 0, 2, 3)) / 2)
    W = (W + W.transpose(0, 1, 3, 2)) / 2
    return W + np.einsum("kl,ij->klij", np.eye(3) / 3, (gram + gram.T) / 2 - np.einsum("kkij->ij", W))


def _defect(integrals: InertiaIntegrals, on_turned: Array, spin: Array, squares: Array, gram: Array) -> Array:
    """(n,) the largest of the terms projected away, of each mode alone and with those before it, beside unit norms."""
    momentum = on_turned[:3] + skew(integrals.P_dm)
    angular = on_turned[3:] - on_turned[3:].transpose(1, 0, 2) + skew(axial(integrals.rP_dm))
    size = np.sqrt(np.trace(integrals.rr_dm))
    trace = np.einsum("aaij->ij", squares) / 2 - gram
    terms = [
        np.abs(momentum).max(axis=(0, 1), initial=0.0) / np.sqrt(integrals.mass),
        np.abs(angular).max(axis=(0, 1), initial=0.0) / size,
        np.abs(np.tril(spin + spin.transpose(0, 2, 1)) / 2).max(axis=(0, 2), initial=0.0),
        np.abs(np.tril(trace)).max(axis=1, initial=0.0),
    ]
    return np.max(terms, axis=0)
