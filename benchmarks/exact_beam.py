"""Geometrically exact beams, independent of both packages: what `benchmarks.second_order` measures against.

Planar and dynamic (Reissner 1972; Simo & Vu-Quoc, J. Appl. Mech. 53 (1986) 849-863): the centroid line r(s) and the turn
theta(s) of the section have the strains

    eps = r' . t1 - 1,   gamma = r' . t2,   kappa = theta',       t1 = (cos theta, sin theta), t2 = (-sin theta, cos theta)

and the energy 1/2 int (EA eps^2 + GA gamma^2 + EI kappa^2) ds. x, y and theta are polynomials of one degree in each element,
so that the mass matrix is constant; time by Radau IIA of order five, which damps waves of shear that nothing resolves.

Spatial and static (Simo & Vu-Quoc, Comput. Meth. Appl. Mech. Engng 58 (1986) 79-116): a cantilever along x with a dead force
F at its end. The moment is (r(L) - r) x F everywhere, so that three numbers, r(L), are sought by shooting.

    python -m benchmarks.exact_beam

computes the motions in tests/reference again and prints how they change by halving elements and steps (some minutes).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import lu_factor, lu_solve
from scipy.optimize import root

Array = np.ndarray

TABLES = Path(__file__).resolve().parent.parent / "tests" / "reference"


@dataclass(frozen=True)
class PlanarBeam:
    """A straight uniform beam along x from the origin, N = elements x degree + 1 nodes.

    length [m];  EA, GA [N] (GA with its shear factor), EI [N m^2];  m [kg/m], mI [kg m] of rotary inertia
    """

    length: float
    EA: float
    GA: float
    EI: float
    m: float
    mI: float
    elements: int = 6
    degree: int = 4

    @property
    def nodes(self) -> int:
        return self.elements * self.degree + 1

    @cached_property
    def straight(self) -> Array:
        """(N, 3) x, y, theta of the undeformed nodes."""
        inner = _lobatto(self.degree)
        size = self.length / self.elements
        x = np.append((np.arange(self.elements)[:, None] + (inner[:-1] + 1) / 2).ravel() * size, self.length)
        return np.stack([x, 0 * x, 0 * x], axis=1)

    @cached_property
    def values(self) -> Array:
        """(G, N) shape functions at the Gauss points of the energy, one less than nodes in an element: no locking."""
        return self.at(*np.polynomial.legendre.leggauss(self.degree))[0]

    @cached_property
    def slopes(self) -> Array:
        """(G, N) their derivatives by s [1/m]."""
        return self.at(*np.polynomial.legendre.leggauss(self.degree))[1]

    @cached_property
    def weights(self) -> Array:
        """(G,) of the Gauss points [m]."""
        return self.at(*np.polynomial.legendre.leggauss(self.degree))[2]

    @cached_property
    def mass(self) -> Array:
        """(3N, 3N), constant."""
        N, _, weights = self.at(*np.polynomial.legendre.leggauss(self.degree + 1))
        return np.kron(N.T @ (weights[:, None] * N), np.diag([self.m, self.m, self.mI]))

    def at(self, points: Array, weights: Array) -> tuple[Array, Array, Array]:
        """Shape functions, their derivatives and weights at points in [-1, 1] of every element."""
        modal = np.linalg.inv(np.polynomial.legendre.legvander(_lobatto(self.degree), self.degree))
        value = np.polynomial.legendre.legvander(points, self.degree) @ modal
        slope = np.polynomial.legendre.legval(points, np.polynomial.legendre.legder(modal)).T
        N, dN = (np.zeros((self.elements * points.size, self.nodes)) for _ in range(2))
        for e in range(self.elements):
            rows = slice(e * points.size, (e + 1) * points.size)
            columns = slice(e * self.degree, (e + 1) * self.degree + 1)
            N[rows, columns], dN[rows, columns] = value, slope * 2 * self.elements / self.length
        return N, dN, np.tile(weights, self.elements) * self.length / self.elements / 2

    def forces(self, u: Array) -> Array:
        """(3N,) elastic forces, the negative gradient of the energy, at u (3N,)."""
        g, N, Q, M, t1, t2 = self._stresses(u)
        along = self.weights[:, None] * (N[:, None] * t1 + Q[:, None] * t2)
        turn = self.weights * (N * (g * t2).sum(axis=1) - Q * (g * t1).sum(axis=1))
        out = np.empty((self.nodes, 3))
        out[:, :2] = self.slopes.T @ along
        out[:, 2] = self.values.T @ turn + self.slopes.T @ (self.weights * M)
        return -out.ravel()

    def stiffness(self, u: Array) -> Array:
        """(3N, 3N) minus the gradient of the forces."""
        g, N, Q, _, t1, t2 = self._stresses(u)
        on_1, on_2 = (g * t1).sum(axis=1), (g * t2).sum(axis=1)
        d_eps = np.concatenate([t1, on_2[:, None]], axis=1)  # by x', y', theta
        d_gamma = np.concatenate([t2, -on_1[:, None]], axis=1)
        H = self.EA * d_eps[:, :, None] * d_eps[:, None] + self.GA * d_gamma[:, :, None] * d_gamma[:, None]
        bend = N[:, None] * t2 - Q[:, None] * t1
        H[:, :2, 2] += bend
        H[:, 2, :2] += bend
        H[:, 2, 2] -= N * on_1 + Q * on_2
        H *= self.weights[:, None, None]
        shape = (self.slopes, self.slopes, self.values)
        K = np.empty((self.nodes, 3, self.nodes, 3))
        for i in range(3):
            for j in range(3):
                K[:, i, :, j] = shape[i].T @ (H[:, i, j, None] * shape[j])
        K[:, 2, :, 2] += self.slopes.T @ (self.EI * self.weights[:, None] * self.slopes)
        return K.reshape(3 * self.nodes, 3 * self.nodes)

    def _stresses(self, u: Array) -> tuple[Array, ...]:
        """r', N, Q, M, t1, t2 at the Gauss points."""
        nodes = u.reshape(-1, 3)
        g, theta = self.slopes @ nodes[:, :2], self.values @ nodes[:, 2]
        t1 = np.stack([np.cos(theta), np.sin(theta)], axis=1)
        t2 = np.stack([-t1[:, 1], t1[:, 0]], axis=1)
        N, Q = self.EA * ((g * t1).sum(axis=1) - 1), self.GA * (g * t2).sum(axis=1)
        return g, N, Q, self.EI * self.slopes @ nodes[:, 2], t1, t2


def _lobatto(degree: int) -> Array:
    """(degree + 1,) nodes of Gauss and Lobatto in [-1, 1]."""
    inner = np.polynomial.legendre.Legendre.basis(degree).deriv().roots()
    return np.concatenate([[-1.0], np.sort(inner.real), [1.0]])


Prescribed = Callable[[float], tuple[list[float], list[float]]]
Load = Callable[[float, Array], Array]

# Radau IIA of three stages (Hairer & Wanner, Solving Ordinary Differential Equations II, table IV.5.6)
_R = np.sqrt(6.0)
NODES = np.array([(4 - _R) / 10, (4 + _R) / 10, 1.0])
RADAU = np.array([
    [(88 - 7 * _R) / 360, (296 - 169 * _R) / 1800, (-2 + 3 * _R) / 225],
    [(296 + 169 * _R) / 1800, (88 + 7 * _R) / 360, (-2 - 3 * _R) / 225],
    [(16 - _R) / 36, (16 + _R) / 36, 1 / 9],
])  # fmt: skip
ITERATIONS, KEPT, CLOSED = 30, 4, 1e-12  # of a step; with one tangent; the change of a place [m, rad] that ends them


def motion(
    beam: PlanarBeam, held: list[int], prescribed: Prescribed, velocity: Array, span: tuple[float, int, int], *,
    gravity: float = 0.0, end_mass: float = 0.0,
) -> Array:  # fmt: skip
    """(rows + 1, N, 3) nodes from the straight beam with the velocities (N, 3).

    held       : numbers of the coordinates that are prescribed: 3 node + (0 for x, 1 for y, 2 for theta)
    prescribed : their values and accelerations at a time
    span       : spacing of the rows [s], their number, steps in each
    gravity    : along -y [m/s^2];  end_mass : [kg], a point at the last node
    """
    M = beam.mass.copy()
    last = 3 * beam.nodes - 3
    M[[last, last + 1], [last, last + 1]] += end_mass
    free = np.setdiff1d(np.arange(3 * beam.nodes), held)
    weight = -gravity * M[free] @ np.tile([0.0, 1.0, 0.0], beam.nodes)
    own, coupled = M[np.ix_(free, free)], M[np.ix_(free, held)]
    u, v = beam.straight.ravel().copy(), velocity.ravel()[free]

    def at(t: float, q: Array) -> Array:
        u[free], u[held] = q, prescribed(t)[0]
        return u

    def load(t: float, q: Array) -> Array:
        return beam.forces(at(t, q))[free] + weight - coupled @ np.asarray(prescribed(t)[1])

    def tangent(t: float, q: Array) -> Array:
        return beam.stiffness(at(t, q))[np.ix_(free, free)]

    spacing, rows, steps = span
    h, q, a = spacing / steps, u[free].copy(), np.zeros((3, free.size))
    found = [at(0.0, q).reshape(-1, 3).copy()]
    for k in range(rows * steps):
        q, v, a = _step(own, load, tangent, k * h, h, q, v, a)
        if (k + 1) % steps == 0:
            found.append(at((k + 1) * h, q).reshape(-1, 3).copy())
    return np.array(found)


def _step(
    M: Array, load: Load, tangent: Load, t: float, h: float, q: Array, v: Array, a: Array
) -> tuple[Array, Array, Array]:
    """Radau IIA: a_i at the stages, M a_i = f(t + c_i h, q + c_i h v + h^2 sum (A^2)_ij a_j)."""
    square, n = RADAU @ RADAU, q.size
    for k in range(ITERATIONS):
        places = q + h * NODES[:, None] * v + h**2 * square @ a
        if k % KEPT == 0:
            K = [tangent(t + c * h, place) for c, place in zip(NODES, places, strict=True)]
            solve = lu_factor(
                np.kron(np.eye(3), M) + h**2 * np.block([[x * K[i] for x in square[i]] for i in range(3)])
            )
        off = np.array([load(t + c * h, place) for c, place in zip(NODES, places, strict=True)]) - a @ M
        change = lu_solve(solve, off.ravel()).reshape(3, n)
        a = a + change
        if h**2 * np.abs(change).max() < CLOSED:
            return q + h * v + h**2 * square[2] @ a, v + h * RADAU[2] @ a, a
    raise RuntimeError(f"exact beam: no stages at {t:g} s with a step of {h:g} s")


def bent(length: float, axial: tuple[float, float, float], turning: tuple[float, float, float], F: Array) -> Array:
    """(3,) the end [m] of a spatial cantilever along x under the dead force F [N] there.

    axial   : EA, GAy, GAz [N];  turning : GJ, EIy, EIz [N m^2], of its principal axes, at the root y and z
    """
    C, D = 1 / np.array(axial), 1 / np.array(turning)

    def rates(_s: float, state: Array, end: Array) -> Array:
        r, A = state[:3], state[3:].reshape(3, 3)
        kappa = D * (A.T @ np.cross(end - r, F))
        turned = A @ np.array([[0, -kappa[2], kappa[1]], [kappa[2], 0, -kappa[0]], [-kappa[1], kappa[0], 0]])
        return np.concatenate([A @ ([1.0, 0.0, 0.0] + C * (A.T @ F)), turned.ravel()])

    def reached(end: Array) -> Array:
        start = np.concatenate([np.zeros(3), np.eye(3).ravel()])
        return solve_ivp(rates, (0, length), start, args=(end,), rtol=1e-11, atol=1e-12, method="DOP853").y[:3, -1]

    end = np.array([length, 0.0, 0.0])
    for share in np.linspace(0.1, 1.0, 10):  # of the force, from the straight beam
        whole, F = F, share * F
        found = root(lambda guess: reached(guess) - guess, end, tol=1e-12)
        end, F = found.x, whole
    if not found.success:
        raise RuntimeError(f"exact beam: {found.message}")
    return end


# ---- the motions in tests/reference --------------------------------------------------------------------------------


def spinning(t: float) -> tuple[float, float, float]:
    """Angle, speed and acceleration of the axis of the spin-up: 6 rad/s in 15 s."""
    T, speed, a = 15.0, 6.0, 2 * np.pi / 15.0
    if t >= T:
        return speed * (t - T / 2), speed, 0.0
    return (
        speed / T * (t**2 / 2 + (np.cos(a * t) - 1) / a**2),
        speed / T * (t - np.sin(a * t) / a),
        speed / T * (1 - np.cos(a * t)),
    )


def pendulum_motion(E: float, elements: int, steps: int) -> Array:
    """(201, 4) time, tip, offset of the middle: 1.2 m x 0.2 m x 9 mm, rho = 5540, released from the horizontal."""
    A, inertia, rho = 0.0018, 1.215e-8, 5540.0
    beam = PlanarBeam(1.2, E * A, 5 / 6 * E / 2.6 * A, E * inertia, rho * A, rho * inertia, elements)
    nodes = motion(
        beam, [0, 1], lambda t: ([0, 0], [0, 0]), np.zeros((beam.nodes, 3)), (0.01, 200, steps), gravity=9.81
    )
    return np.column_stack([np.arange(201) * 0.01, nodes[:, -1, :2], _middle(nodes)])


def slider_crank_motion(elements: int, steps: int) -> Array:
    """(211, 2) time, offset of the middle of the rod: 0.3 m, 6 mm, crank of 0.15 m at 150 rad/s, slider half its mass."""
    E, rho, d, length, r, speed = 2e11, 7870.0, 0.006, 0.3, 0.15, 150.0
    A, inertia = np.pi * d**2 / 4, np.pi * d**4 / 64
    beam = PlanarBeam(length, E * A, 0.9 * E / 2.6 * A, E * inertia, rho * A, rho * inertia, elements)
    velocity = np.zeros((beam.nodes, 3))
    velocity[:, 1], velocity[:, 2] = r * speed * (1 - beam.straight[:, 0] / length), -r * speed / length

    def pin_and_slider(t: float) -> tuple[list[float], list[float]]:
        c, s = r * np.cos(speed * t), r * np.sin(speed * t)
        return [c - r, s, 0.0], [-c * speed**2, -s * speed**2, 0.0]

    held = [0, 1, 3 * beam.nodes - 2]
    nodes = motion(beam, held, pin_and_slider, velocity, (4e-4, 210, steps), end_mass=beam.m * length / 2)
    return np.column_stack([np.arange(211) * 4e-4, _middle(nodes)])


def spin_up_motion(elements: int, steps: int) -> Array:
    """(151, 3) time, axial and lateral deviation of the tip in axes that turn with the root."""
    beam = PlanarBeam(10.0, 2.8e7, 1e7, 1.4e4, 1.2, 6e-4, elements)

    def root_turned(t: float) -> tuple[list[float], list[float]]:
        angle, _, acceleration = spinning(t)
        return [0.0, 0.0, angle], [0.0, 0.0, acceleration]

    nodes = motion(beam, [0, 1, 2], root_turned, np.zeros((beam.nodes, 3)), (0.1, 150, steps))
    time = np.arange(151) * 0.1
    angle = np.array([spinning(t)[0] for t in time])
    (x, y), c, s = nodes[:, -1, :2].T, np.cos(angle), np.sin(angle)
    return np.column_stack([time, c * x + s * y - 10.0, c * y - s * x])


def _middle(nodes: Array) -> Array:
    """(T,) offset of the middle node from the chord, to the left [m]."""
    first, last, middle = nodes[:, 0, :2], nodes[:, -1, :2], nodes[:, nodes.shape[1] // 2, :2]
    chord, offset = last - first, middle - (first + last) / 2
    left: Array = (chord[:, 0] * offset[:, 1] - chord[:, 1] * offset[:, 0]) / np.linalg.norm(chord, axis=1)
    return left


MOTIONS: dict[str, tuple[Callable[[int, int], Array], str, list[int], int, int]] = {
    "pendulum, E = 7e10": (lambda e, k: pendulum_motion(7e10, e, k), "pendulum_exact.csv", [0, 1, 2, 3], 8, 10),
    "pendulum, E = 7e9": (lambda e, k: pendulum_motion(7e9, e, k), "pendulum_soft_exact.csv", [0, 1, 2, 3], 8, 10),
    "pendulum, E = 7e8": (lambda e, k: pendulum_motion(7e8, e, k), "pendulum_soft_exact.csv", [0, 4, 5, 6], 8, 10),
    "slider-crank": (slider_crank_motion, "slider_crank_exact.csv", [0, 1], 4, 16),
    "spin-up": (spin_up_motion, "spin_up_exact.csv", [0, 1, 2], 4, 20),
}


def main() -> None:
    """Compute each motion twice, with half the elements and steps first, and compare with the table: largest deviations."""
    print(f"{'':24}{'halving':>12}{'table':>12}   [m]")
    for name, (compute, table, columns, elements, steps) in MOTIONS.items():
        coarse, fine = compute(elements // 2, steps // 2), compute(elements, steps)
        kept = np.loadtxt(TABLES / table, delimiter=",")[:, columns]
        n = min(len(kept), len(fine))
        halved, off = np.abs(fine - coarse).max(), np.abs(fine[:n] - kept[:n]).max()
        print(f"{name:24}{halved:12.2g}{off:12.2g}", flush=True)


if __name__ == "__main__":
    main()
