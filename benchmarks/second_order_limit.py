"""What the second-order theory leaves out, however it is computed: the slider-crank of `benchmarks.second_order`.

    python -m benchmarks.second_order_limit

computes the rod by a model of its own, independent of both packages (finite elements: `benchmarks.exact_beam`): in the plane,
in its mean-axis frame, points at u_0 + Phi q + u_2(q) with the strains of Reissner's beam, of second order,

    u_2x' = - (u_y' theta - theta^2 / 2)      u_2y' = u_x' theta

four fixed-interface modes and three shapes of the ends. It prints the error of the middle of the rod against the exact beam,
relative to its peak: with the energies that the packages take, with all the kinetic energy of u_2, and with the strain energy
of fourth order, int EI kappa^2 theta^2 / 2. The first figure is that of `benchmarks.second_order slider-crank`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from benchmarks.exact_beam import TABLES, PlanarBeam

Array = np.ndarray

E, RHO, DIAMETER, LENGTH, CRANK, SPEED = 2e11, 7870.0, 0.006, 0.3, 0.15, 150.0
AREA, INERTIA = np.pi * DIAMETER**2 / 4, np.pi * DIAMETER**4 / 64
ROD = PlanarBeam(LENGTH, E * AREA, 0.9 * E / 2.6 * AREA, E * INERTIA, RHO * AREA, RHO * INERTIA, elements=1, degree=24)
POINTS = 41  # of Gauss; that of number 20 is the middle
ENDS = np.array([[-LENGTH / 2, LENGTH / 2], [0.0, 0.0]])


def modes(bending: int) -> tuple[Array, Array]:
    """(n,) omega^2, (3N, n) shapes: fixed-interface bending modes and those of the ends, without the rigid ones."""
    K, M, size = ROD.stiffness(ROD.straight.ravel()), ROD.mass, 3 * ROD.nodes
    ends = np.array([0, 1, 2, size - 3, size - 2, size - 1])
    inner = np.setdiff1d(np.arange(size), ends)
    inside = np.ix_(inner, inner)
    _, V = eigh(K[inside], M[inside])
    lateral = np.abs(V[inner % 3 == 1]).max(axis=0) > np.abs(V[inner % 3 == 0]).max(axis=0)
    shapes = np.zeros((size, 6 + bending))
    shapes[ends, :6] = np.eye(6)
    shapes[inner, :6] = -np.linalg.solve(K[inside], K[np.ix_(inner, ends)])
    shapes[inner, 6:] = V[:, lateral][:, :bending]
    omega2, Y = eigh(shapes.T @ K @ shapes, shapes.T @ M @ shapes)
    return omega2[3:], shapes @ Y[:, 3:]


class Rod:
    """Shapes (2, P, n), second-order displacements -> q B q / 2 (2, P, n, n) at the Gauss points, and at both ends."""

    def __init__(self, bending: int) -> None:
        self.omega2, shapes = modes(bending)
        points, weights = np.polynomial.legendre.leggauss(POINTS)
        value, slope, weights = ROD.at(points, weights)
        at_ends = ROD.at(np.array([-1.0, 1.0]), np.ones(2))[0]
        self.weights, self.dm = weights, weights * ROD.m
        self.place = np.stack([points * LENGTH / 2, 0 * points])
        self.phi, self.phi_ends = (np.stack([v @ shapes[0::3], v @ shapes[1::3]]) for v in (value, at_ends))
        self.theta, self.kappa = value @ shapes[2::3], slope @ shapes[2::3]
        stretch, tilt = slope @ shapes[0::3], slope @ shapes[1::3]
        rates = (
            _symmetric(self.theta, self.theta) - 2 * _symmetric(tilt, self.theta),
            2 * _symmetric(stretch, self.theta),
        )
        within, whole = np.array([self._integrated(f) for f in rates]), np.array([_sum(weights, f) for f in rates])
        mean = np.array([_sum(self.dm, f) / self.dm.sum() for f in within])
        self.spin = _sum(self.dm * self.place[0] ** 2, np.ones(POINTS)) + ROD.mI * LENGTH
        turn = _sum(self.dm * self.place[0], within[1]) / self.spin
        self.B, self.B_ends = within - mean[:, None], np.stack([-mean, whole - mean], axis=1)
        self.B[1] -= self.place[0][:, None, None] * turn
        self.B_ends[1] -= ENDS[0][:, None, None] * turn

    def _integrated(self, rate: Array) -> Array:
        """From the root to every Gauss point."""
        x = self.place[0] * 2 / LENGTH
        fit = np.linalg.inv(np.polynomial.legendre.legvander(x, POINTS - 1))
        powers = np.polynomial.legendre.legint(fit, lbnd=-1, axis=0) * LENGTH / 2
        return np.tensordot(np.polynomial.legendre.legvander(x, POINTS) @ powers, rate, 1)


def _symmetric(a: Array, b: Array) -> Array:
    outer = a[:, :, None] * b[:, None]
    return (outer + outer.swapaxes(1, 2)) / 2


def _sum(weights: Array, values: Array) -> Array:
    return np.tensordot(weights, values, 1)


def _cross(a: Array, b: Array) -> Array:
    return a[0] * b[1] - a[1] * b[0]


@dataclass(frozen=True)
class Theory:
    """Which terms are taken beyond those of the packages."""

    kinetic: bool = False
    strain: bool = False


def inertia(rod: Rod, theory: Theory, q: Array, qd: Array, omega: float) -> tuple[Array, Array]:
    """Mass matrix (1 + n, 1 + n) and right-hand side of [omega, q], from T = J omega^2/2 + omega h qd + qd N qd/2."""
    n, u, ud = q.size, rod.phi @ q, rod.phi @ qd
    bent = rod.B @ q
    u2, u2d, bias = bent @ q / 2, bent @ qd, (rod.B @ qd) @ qd

    def total(a: Array, shapes: Array) -> Array:
        return np.einsum("p,cp,cp...->...", rod.dm, a, shapes)

    def moment(a: Array, shapes: Array) -> Array:
        return _sum(rod.dm, _cross(a[:, :, None], shapes))

    J, h, N = rod.spin + total(2 * rod.place + u, u) + 2 * total(rod.place, u2), moment(u, rod.phi), np.eye(n)
    by_q, skew = 2 * total(rod.place + u, rod.phi) + 2 * total(rod.place, bent), -2 * moment(ud, rod.phi)
    force, spin = -rod.omega2 * q, 0.0
    if theory.kinetic:
        J += 2 * total(u, u2) + total(u2, u2)
        by_q = by_q + 2 * (total(u, bent) + total(u2, rod.phi) + total(u2, bent))
        h = h + moment(u, bent) + moment(u2, rod.phi + bent)
        skew = skew - 2 * (moment(ud, bent) + moment(u2d, rod.phi + bent))
        spin = _sum(rod.dm, _cross(u + u2, bias))
        mixed = np.einsum("p,cpi,cpj->ij", rod.dm, rod.phi, bent)
        N = N + mixed + mixed.T + np.einsum("p,cpi,cpj->ij", rod.dm, bent, bent)
        force = force - total(bias, rod.phi + bent)
    if theory.strain:
        theta, kappa, stiff = rod.theta @ q, rod.kappa @ q, ROD.EI * rod.weights
        force = force - (stiff * kappa * theta**2) @ rod.kappa - (stiff * kappa**2 * theta) @ rod.theta
    M = np.block([[np.array([[J]]), h[None]], [h[:, None], N]])
    return M, np.append(-by_q @ qd * omega - spin, force + by_q * omega**2 / 2 + omega * skew)


def rates(rod: Rod, theory: Theory, t: float, state: Array) -> Array:
    """Of [R, angle, q] and their rates; the root on the crank's pin, the tip with the slider on the line."""
    n = rod.omega2.size
    v, angle, q, omega, qd = state[3 + n :], state[2], state[3 : 3 + n], state[5 + n], state[6 + n :]
    c, s = np.cos(angle), np.sin(angle)
    A, turned = np.array([[c, -s], [s, c]]), np.array([[-s, -c], [c, -s]])
    mass, f = np.zeros((3 + n, 3 + n)), np.zeros(3 + n)
    mass[0, 0] = mass[1, 1] = rod.dm.sum()
    mass[2:, 2:], f[2:] = inertia(rod, theory, q, qd, omega)
    bent = rod.B_ends @ q
    rho, P, growth = ENDS + rod.phi_ends @ q + bent @ q / 2, rod.phi_ends + bent, (rod.B_ends @ qd) @ qd
    jac = [np.hstack([np.eye(2), (turned @ rho[:, k])[:, None], A @ P[:, k]]) for k in range(2)]
    bias = [-(omega**2) * A @ rho[:, k] + 2 * omega * turned @ (P[:, k] @ qd) + A @ growth[:, k] for k in range(2)]
    slider = rod.dm.sum() / 2
    mass += slider * np.outer(jac[1][0], jac[1][0])
    f -= slider * jac[1][0] * bias[1][0]
    pin = -CRANK * SPEED**2 * np.array([np.cos(SPEED * t), np.sin(SPEED * t)])
    rows = np.vstack([jac[0], jac[1][1]])
    whole = np.block([[mass, rows.T], [rows, np.zeros((3, 3))]])
    right = np.concatenate([f, pin - bias[0], [-bias[1][1]]])
    return np.concatenate([v, np.linalg.solve(whole, right)[: 3 + n]])


def middle(rod: Rod, q: Array) -> float:
    """Offset of the middle from the chord, to the left."""
    k = POINTS // 2
    at = rod.place[:, k] + rod.phi[:, k] @ q + (rod.B[:, k] @ q) @ q / 2
    ends = ENDS + rod.phi_ends @ q + (rod.B_ends @ q) @ q / 2
    chord = ends[:, 1] - ends[:, 0]
    return float(_cross(chord, at - ends.mean(axis=1)) / np.linalg.norm(chord))


def error(rod: Rod, theory: Theory, step: float = 1e-5) -> float:
    """Of the middle over 0.084 s, relative to its peak, by the classical method of Runge and Kutta."""
    exact = np.loadtxt(TABLES / "slider_crank_exact.csv", delimiter=",")
    n, t = rod.omega2.size, 0.0
    state, spin = np.zeros(6 + 2 * n), -CRANK * SPEED / LENGTH
    state[0], state[4 + n], state[5 + n] = CRANK + LENGTH / 2, -spin * LENGTH / 2, spin
    found = []
    for row in exact[:, 0]:
        while t < row - step / 2:
            k1 = rates(rod, theory, t, state)
            k2 = rates(rod, theory, t + step / 2, state + step / 2 * k1)
            k3 = rates(rod, theory, t + step / 2, state + step / 2 * k2)
            k4 = rates(rod, theory, t + step, state + step * k3)
            state, t = state + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4), t + step
        found.append(middle(rod, state[3 : 3 + n]))
    return float(np.abs(np.array(found) - exact[:, 1]).max() / exact[:, 1].max())


def main() -> None:
    rod = Rod(4)
    for words, theory in (
        ("the theory of the packages", Theory()),
        ("with all kinetic energy of u_2", Theory(kinetic=True)),
        ("with the strain energy of fourth order", Theory(strain=True)),
        ("with both", Theory(kinetic=True, strain=True)),
    ):
        print(f"{words:40}{error(rod, theory):10.2e}", flush=True)


if __name__ == "__main__":
    main()
