"""The second-order displacement of a model: what drives it, and what of it shows.

A body that bends shortens: with the strain eps = eps_L(u) + eps_N(u, u) and u = Phi q + u_2 the displacement u_2 relaxes the
strain that products of first-order displacements make,

    u_2 = 1/2 sum_ij q_i q_j u_ij,    K u_ij = - F_ij    under the reference conditions.

F_ij is the geometric stiffness as a linear form: under any load with the static displacement w and the amplitudes a of the
known loads, the geometric stiffness of the basis is

    K_sigma,ij = F_ij . w + E_ij . a.

So by reciprocity the load does the work -K_sigma,ij on u_ij: at an interface u_2 = -1/2 q K_L q with the stored matrices.
E_ij is there because coordinates of interfaces, and nodes that follow them or turn, move to second order in the independent
coordinates: a point at the arm r from one that turns by the rotation vector phi moves by phi x r + 1/2 phi x (phi x r).

Source: as `ffr_prep.solids.stiffening`; O. Wallrapp, R. Schwertassek, Int. J. Numer. Meth. Eng. 32 (1991) 1833-1850.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ffr_prep.body import Surface
from ffr_prep.common.arrays import Array


@dataclass(frozen=True)
class SecondOrder:
    """The second order of a basis (Z, n), pair by pair.

    known    : (12 + 6 I, n, n) E
    forces   : some of the i -> (Z, ...) F_ij of each with the j from i on
    surface  : (i, u_ij (Z, n - i)) -> what is drawn, with the displacements of the pairs in the place of the basis
    stressed : the same with the stress of the pairs, where stress is known
    """

    known: Array
    forces: Callable[[range], Array]
    surface: Callable[[int, Array], Surface | None]
    stressed: Callable[[int, Array], Surface | None]
