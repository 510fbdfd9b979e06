"""Kernels are compiled in a process of their own, and every run loads them from disk.

A process that has just compiled them runs other machine code than one that loads them: calls between kernels are bound to
copies that were optimised apart. Both are right, but sums are taken in another order, so that the last bits would differ
between the first run on a machine and all later ones, and a run that is continued would not be the same to the bit.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np

import ffr_dyn
from ffr_dyn.equations import compile_scene, new_record, new_stages, new_work
from ffr_dyn.integrators import METHODS, Integrator
from ffr_dyn.kernels.options import is_compiled
from ffr_dyn.layout import initial_state
from ffr_dyn.scene import Body, Scene
from ffr_prep.body import rigid_body

_PACKAGE = Path(ffr_dyn.__file__).resolve().parent


def precompile(method: Integrator) -> None:
    """Have the kernels of a method on disk, where they can be kept beside their sources; says so when it takes time."""
    if is_compiled(method.run.__name__):
        return
    print("ffr-dyn: compiling the kernels, once (about half a minute) ...", file=sys.stderr, flush=True)
    word = next((word for word, made in METHODS.items() if type(method) is made), None)
    if word is None or "NUMBA_CACHE_DIR" in os.environ or not os.access(_PACKAGE / "integrators", os.W_OK):
        return  # compiled by the run itself
    path = os.pathsep.join([str(_PACKAGE.parent), *filter(None, [os.environ.get("PYTHONPATH")])])
    command = [sys.executable, "-c", f"from ffr_dyn.analyses.precompile import compile_now; compile_now({word!r})"]
    subprocess.run(command, env={**os.environ, "PYTHONPATH": path}, check=False)


def compile_now(word: str) -> None:
    """Compile the kernels of a method in this process, by a run of no steps."""
    body = rigid_body("body", mass=1.0, inertia=np.ones(3))
    system, method = compile_scene(Scene((Body("body", body),))), METHODS[word](1.0)
    work, stages, record = new_work(system.model), new_stages(system, method.stage_count), new_record(system, 1)
    x, v = initial_state(system.scene, system.layout)
    method.run(system.model, work, stages, 0.0, 1.0, 0, 0, x, v, 0.0, 0.0, 0.0, record)
