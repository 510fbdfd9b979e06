"""The first use of a method: its time loop is compiled in a process of its own, and read from the cache like ever after.

What a process compiles for itself it links with what it has compiled before, and the last bits of a sum may differ from
those of the same loop read from the cache. So no run uses what it has just compiled: the first one equals all later ones
to the bit.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np

from ffr_dyn.equations import compile_scene, new_record, new_stages, new_work
from ffr_dyn.integrators import METHODS, Integrator
from ffr_dyn.layout import initial_state
from ffr_dyn.scene import Body, Scene
from ffr_prep.body import rigid_body

_AT_WORK: dict[str, subprocess.Popen[bytes]] = {}


def begin_compiling(kind: type[Integrator]) -> None:
    """Start to compile the time loop of a method where it is not on disk, and go on with something else meanwhile.

    For programs that mesh and reduce bodies first: a run that needs the time loop waits for it.
    """
    names = [name for name, known in METHODS.items() if kind is known]
    if names and names[0] not in _AT_WORK and not _is_cached(kind):
        print("ffr-dyn: compiling the kernels, once (about a minute) ...", file=sys.stderr, flush=True)
        same_packages = {**os.environ, "PYTHONPATH": os.pathsep.join(path or os.getcwd() for path in sys.path)}
        _AT_WORK[names[0]] = subprocess.Popen([sys.executable, "-m", __name__, names[0]], env=same_packages)


def ensure_compiled(method: Integrator) -> None:
    """Compile the time loop of a method where no compiled form is on disk; where that fails, the run does it itself."""
    begin_compiling(type(method))
    for name in [name for name, kind in METHODS.items() if type(method) is kind and name in _AT_WORK]:
        _AT_WORK.pop(name).wait()


def _is_cached(kind: type[Integrator]) -> bool:
    folder = Path(kind.run._cache.cache_path)
    return any(folder.glob(f"*.{kind.run.__name__}-*.nbi"))


def run_nothing(method: Integrator) -> None:
    """A run of no steps of one body, which needs the compiled time loop."""
    scene = Scene((Body("body", rigid_body("body", mass=1.0, inertia=np.eye(3))),))
    system = compile_scene(scene)
    x, v = initial_state(scene, system.layout)
    work, stages, record = new_work(system.model), new_stages(system, method.stage_count), new_record(system, 1)
    method.run(system.model, work, stages, 0.0, method.step, 0, 0, np.array(x), np.array(v), 0.0, 0.0, 0.0, record)


if __name__ == "__main__":
    run_nothing(METHODS[sys.argv[1]](1e-3))
