"""Size: time and memory from a mesh file to a body file, beside SciPy's eigsh and SuperLU in the same run.

    python -m benchmarks.size [--dof N] [--peer N] [--solver NAME ...] [--ranks N] [--large N] [--hundreds N] [--second]

Body: the steel rod of meshes/connecting_rod.geo in 10-node tetrahedra, both eyes rigid interfaces; 30 fixed-interface modes
and 12 constraint modes, frame simply supported between the eyes: 36 elastic coordinates. From the .msh file to the body
file, linear; drawing the mesh and compiling, which happens once, are left out. --second has the same body with its load
matrices and the second order of its surface beside it, --hundreds one of 300 modes that are verified.

Goals, on two quiet cores: 1,064,166 unknowns in 150 s and 10 GiB, 306,426 in 35 s and 3 GiB, 300 verified modes of these
in 4 minutes.

Every run is a process of its own. Printed are the time on the clock, the processor time, which a busy machine disturbs
less, and the most memory of each step (elsewhere than on Linux: since the start). The load of the machine stands beside
every run.

The peer shares reading, checking, assembly, coupling, inertia integrals and file with us; the fixed-interface modes are
those of `scipy.sparse.linalg.eigsh` in its shift-invert mode about zero on SciPy's SuperLU with the setting that was its
best (MMD_AT_PLUS_A, symmetric mode, no pivoting), and the constraint modes 12 more solves with the same factor. It needs
minutes at 300,000 unknowns: by default it runs at a third of the size, and the ratio is printed for equal sizes only.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import scipy.linalg
import scipy.sparse.linalg as spl

import ffr_prep as fp
from ffr_prep.body import FlexibleBody, save_body
from ffr_prep.common.process_memory import begin_peak, peak
from ffr_prep.mesh.mesh import read_mesh
from ffr_prep.model.coupled import CoupledModel, InterfaceRegion
from ffr_prep.model.material import material
from ffr_prep.model.reference import SimplySupported
from ffr_prep.reduction.basis import Basis, diagonalised, restricted
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.solvers.factor import FreeBody, Solver

Array = np.ndarray

GEOMETRY = Path(__file__).resolve().parents[1] / "meshes" / "connecting_rod.geo"
EYES = ("big_eye", "small_eye")
MODES = 30
LINEAR, SECOND, HUNDREDS = "linear", "second order", "300 verified modes"
_SIZES = ((3.1, 93_144), (1.93, 306_426), (1.2, 1_064_166))  # largest edge [mm], unknowns


# ---- one run, in a process of its own -----------------------------------------------------------------------------


@dataclass
class Clock:
    """Notes what each step takes: time on the clock, processor time, most memory while it goes on [GiB]."""

    steps: list[tuple[str, float, float, float]] = field(default_factory=list)
    begun: tuple[str, float, float] | None = None

    def __call__(self, step: str) -> None:
        """A step begins, and the one before ends."""
        now = time.perf_counter(), time.process_time()
        if self.begun:
            name, wall, cpu = self.begun
            self.steps.append((name, now[0] - wall, now[1] - cpu, (peak() or 0) / 2**30))
        begin_peak()
        self.begun = (step, *now)


@dataclass(frozen=True)
class ByEigsh:
    """Craig-Bampton by the peer; the eyes' coordinates are the last twelve of the model."""

    modes: int

    def basis(self, model: CoupledModel, body: FreeBody, L: Array) -> Basis:
        """As `CraigBampton.basis`."""
        inner = model.K.shape[0] - 12
        K, M = model.K[:inner][:, :inner].tocsc(), model.M[:inner][:, :inner].tocsc()
        coupling = model.K[:inner][:, inner:].toarray()
        lu = spl.splu(K, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        inverse = spl.LinearOperator(K.shape, lu.solve)
        omega2, modes = spl.eigsh(K, self.modes, M, sigma=0.0, OPinv=inverse)
        shapes = np.vstack([-lu.solve(coupling), np.eye(12)])
        stiffness = model.K[inner:][:, inner:].toarray() + coupling.T @ shapes[:inner]
        vectors = np.hstack([np.vstack([modes, np.zeros((12, self.modes))]), shapes])
        small = scipy.linalg.block_diag(np.diag(omega2), (stiffness + stiffness.T) / 2)
        return diagonalised(model, *restricted(model, vectors, small, L))


def run(mesh_file: Path, body_file: Path, solver: str, ranks: int, kind: str) -> None:
    """Mesh file to body file; the figures as a line of JSON."""
    clock = Clock()
    mesh = read_mesh(mesh_file, unit="mm", progress=clock)
    body = _reduced(mesh, solver, ranks, kind, clock)
    clock("write the body file")
    save_body(body, body_file)
    clock("")
    most = max(step[3] for step in clock.steps)
    figures = {"dof": 3 * len(mesh.points), "steps": clock.steps, "peak": most, "frequencies": _hertz(body)}
    print(json.dumps(figures))


def _reduced(mesh: Any, solver: str, ranks: int, kind: str, clock: Clock) -> FlexibleBody:
    own: dict[str, Any] = {"solver": Solver(solver, ranks, kind == HUNDREDS)} if solver != "eigsh" else {}
    modes = 300 if kind == HUNDREDS else MODES
    if solver == "eigsh":
        import ffr_prep.pipelines.reduce

        ffr_prep.pipelines.reduce.factorised = lambda *_: None  # type: ignore[attr-defined]  # its work is the peer's own
    return fp.reduce(
        fp.from_mesh(mesh, material("steel"), [InterfaceRegion(eye) for eye in EYES], progress=clock),
        fp.Request(
            name="rod",
            linear=kind != SECOND,
            reference=SimplySupported(*EYES),
            reduction=ByEigsh(modes) if solver == "eigsh" else CraigBampton(modes),
            **own,
        ),
        progress=clock,
    )


def _hertz(body: FlexibleBody) -> list[float]:
    return (np.sqrt(body.omega2) / (2 * np.pi)).tolist()


# ---- all runs -----------------------------------------------------------------------------------------------------


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description="Time and memory from a mesh file to a body file.")
    parser.add_argument("--dof", type=int, default=300_000, help="unknowns of our run")
    parser.add_argument("--peer", type=int, default=100_000, help="unknowns of the run beside SciPy; 0 for none")
    parser.add_argument("--solver", nargs="*", default=[], help="further solvers at the size of --dof")
    parser.add_argument("--ranks", type=int, default=2, help="processes of the solver slepc")
    parser.add_argument("--large", type=int, default=0, help="unknowns of a last run of ours, such as 1000000")
    parser.add_argument("--hundreds", type=int, default=0, help="unknowns of a run with 300 verified modes")
    parser.add_argument("--second", action="store_true", help="also with load matrices and second order")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="ffr-size-") as folder:
        _measured(Path(folder), 100_000, "cholesky", show=False)  # compiles
        ours = {dof: _measured(Path(folder), dof, "cholesky") for dof in dict.fromkeys((asked.dof, asked.peer)) if dof}
        if asked.peer:
            _compare(ours[asked.peer], _measured(Path(folder), asked.peer, "eigsh"))
        for solver in asked.solver:
            _compare(
                ours[asked.dof], _measured(Path(folder), asked.dof, solver, asked.ranks if solver == "slepc" else 1)
            )
        if asked.second:
            _measured(Path(folder), asked.dof, "cholesky", kind=SECOND)
        for unknowns, kind in ((asked.hundreds, HUNDREDS), (asked.large, LINEAR)):
            if unknowns:
                _measured(Path(folder), unknowns, "cholesky", kind=kind)


def _measured(
    folder: Path, dof: int, solver: str, ranks: int = 1, show: bool = True, kind: str = LINEAR
) -> dict[str, Any]:
    mesh = folder / f"rod_{dof}.msh"
    if not mesh.exists():
        _draw(mesh, dof)
    load = os.getloadavg()[0]
    files = [str(mesh), str(folder / "rod.ffr")]
    command = [sys.executable, "-m", "benchmarks.size", "run", *files, solver, str(ranks), kind]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=GEOMETRY.parents[1])
    if done.returncode:
        sys.exit(f"{solver} at {dof} unknowns ended with code {done.returncode}: {done.stderr[-2000:]}")
    figures: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    figures["solver"] = solver if kind == LINEAR else f"{solver}, {kind}"
    figures["wall"], figures["cpu"] = (sum(step[k] for step in figures["steps"]) for k in (1, 2))
    if show:
        _show(figures, load)
    return figures


def _draw(mesh: Path, dof: int) -> None:
    """The rod with about as many unknowns; on curved surfaces there are more than the edge alone would give."""
    (edge, known) = min(_SIZES, key=lambda size: abs(np.log(size[1] / dof)))
    size = edge * (known / dof) ** (1 / 3) if abs(known / dof - 1) > 0.1 else edge
    gmsh = [sys.executable, "-c", _GMSH, str(GEOMETRY), str(mesh), str(size)]
    subprocess.run(gmsh, check=True, capture_output=True)


_GMSH = """
import sys, gmsh
gmsh.initialize(["gmsh", "-setnumber", "size", sys.argv[3]], interruptible=False)
for name, value in {"General.NumThreads": 1, "Mesh.Algorithm3D": 10, "Mesh.Optimize": 1, "Mesh.Binary": 1}.items():
    gmsh.option.setNumber(name, value)
gmsh.open(sys.argv[1])
gmsh.model.mesh.generate(3)
gmsh.model.mesh.setOrder(2)
gmsh.write(sys.argv[2])
"""


def _show(figures: dict[str, Any], load: float) -> None:
    print(
        f"{figures['solver']}, {figures['dof']} unknowns: {figures['wall']:.1f} s on the clock, {figures['cpu']:.1f} s of "
        f"processor, {figures['peak']:.2f} GiB at most (load before it {load:.1f} on {os.cpu_count()} cores)"
    )
    for name, wall, cpu, most in figures["steps"]:
        print(f"    {name:32s} {wall:7.1f} s {cpu:7.1f} s {most:7.2f} GiB")
    sys.stdout.flush()


def _compare(ours: dict[str, Any], other: dict[str, Any]) -> None:
    """Ratios at equal size, and how far the frequencies are apart."""
    apart = max(abs(a / b - 1) for a, b in zip(ours["frequencies"], other["frequencies"], strict=True))
    wall, cpu, peak = (other[key] / ours[key] for key in ("wall", "cpu", "peak"))
    print(
        f"    {other['solver']} against ours: time {wall:.1f}, processor time {cpu:.1f}, memory {peak:.1f} times; "
        f"frequencies {apart:.0e} apart\n"
    )
    sys.stdout.flush()


if __name__ == "__main__":
    if sys.argv[1:2] == ["run"]:
        run(Path(sys.argv[2]), Path(sys.argv[3]), sys.argv[4], int(sys.argv[5]), sys.argv[6])
    else:
        main()
