"""The first use of a method: what it needs is compiled by two processes of their own, and read from disk ever after.

What a process compiles for itself may differ in the last bits from what it reads from disk. So no run uses what it has just
compiled: the first one equals all later ones to the bit.
"""

from __future__ import annotations

import gc
import os
import subprocess
import sys
import threading
from collections.abc import Sequence

from ffr_dyn.integrators import Integrator, methods
from ffr_dyn.kernels.entry_points import add_loads, load_powers, run_controlled
from ffr_dyn.kernels.simd.entry_point import ENTRY_POINTS, CompiledFunction, always
from ffr_dyn.kernels.simd.force_kernel import kernel_of
from ffr_dyn.kernels.simd.intrinsics import compiled_forms
from ffr_prep.common.children import ending_with_us

Kernel = str | CompiledFunction  # of a force: "package.module:name", or itself where that is not known

FORCES = ("ffr_dyn.kernels.forces.load:load", "ffr_dyn.kernels.forces.spring:spring")  # of a scene not known yet
_AT_WORK: dict[str, subprocess.Popen[bytes]] = {}
_LOOKING = threading.Lock()  # several runs may begin at the same time
_ON_DISK: set[str] = set()  # functions that were found there before: a program with many runs looks once
_READY: set[tuple[object, ...]] = set()  # what was asked for before


def begin_compiling(*kinds: type[Integrator], forces: Sequence[Kernel] = FORCES) -> None:
    """Start to compile what some methods need where it is not on disk, and go on with something else meanwhile.

    For programs that mesh and reduce bodies first: a run that needs it waits.

    forces : kernels of the scene's forces

    Raises InputError for a kernel that is none of a force.

    >>> fd.begin_compiling(fd.ROS2)
    """
    _begin(kinds, _of_any_scene(), forces)


def _begin(kinds: Sequence[type[Integrator]], of_scene: Sequence[CompiledFunction], forces: Sequence[Kernel]) -> None:
    functions = [*of_scene, *(step for step in _steps() if any(kind.do_step is step for kind in kinds))]
    if any(kind.controlled for kind in kinds):
        functions.append(run_controlled.general)
    wanted = {each.name: each for each in functions} | {one: kernel_of(one) for one in forces if isinstance(one, str)}
    kept = {name: each for name, each in wanted.items() if each.own}
    _ON_DISK.update(name for name, each in kept.items() if name not in _ON_DISK and compiled_forms(each.function))
    missing = [name for name in kept if name not in _AT_WORK and name not in _ON_DISK]
    if not missing:
        return
    print("ffr-dyn: compiling the kernels, once (some twenty seconds) ...", file=sys.stderr, flush=True)
    packages = os.pathsep.join(path or os.getcwd() for path in sys.path)
    environment = {**os.environ, "PYTHONPATH": packages, "FFR_DYN_COMPILING": "1"}
    for share in _shares(missing):
        process = subprocess.Popen(ending_with_us([sys.executable, "-m", __name__, *share]), env=environment)
        _AT_WORK.update(dict.fromkeys(share, process))


def _of_any_scene() -> list[CompiledFunction]:
    """Compiled functions that a scene with applied loads needs whatever the method."""
    usual = [entry.general for entry in ENTRY_POINTS.values() if entry.needed is always]
    return [*usual, add_loads.general, load_powers.general]


def ensure_compiled(
    *kinds: type[Integrator], chosen: Sequence[CompiledFunction | None] = (), forces: Sequence[Kernel] = ()
) -> None:
    """Have what some methods need on disk; where that fails, the run compiles them itself.

    chosen : of the entry points, by number; None for those that the scene does not call
    """
    wanted = (kinds, *chosen, *forces)
    if wanted in _READY:
        return
    with _LOOKING:
        _begin(kinds, [each for each in chosen if each is not None] or _of_any_scene(), forces)
        for process in set(_AT_WORK.values()):
            process.wait()
        _AT_WORK.clear()
    _READY.add(wanted)


def _shares(names: Sequence[str]) -> list[list[str]]:
    """Two parts that take about as long; those that take long come first."""
    return [share for share in ([*names[::4], *names[3::4]], [*names[1::4], *names[2::4]]) if share]


def _steps() -> list[CompiledFunction]:
    """The compiled steps of all methods."""
    return list(dict.fromkeys(kind.do_step for kind in methods().values()))


def compile_functions(names: Sequence[str]) -> None:
    """Compile functions by their names, kernels of forces by "package.module:name"."""
    forms = [form for entry in ENTRY_POINTS.values() for form in (entry.general, *(form for _, form in entry.forms))]
    known = {compiled.name: compiled for compiled in (*forms, *_steps())}
    for name in names:
        compiled = kernel_of(name) if ":" in name else known[name]
        if not compiled.address:
            raise RuntimeError(f"{name} has no address")


if __name__ == "__main__":
    gc.disable()  # this process ends soon; looking for what it no longer needs takes time alone
    compile_functions(sys.argv[1:])
