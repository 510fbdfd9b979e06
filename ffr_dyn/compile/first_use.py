"""The first use of a method: the units it needs are compiled by two processes of their own, and read from disk ever after.

What a process compiles for itself may differ in the last bits from what it reads from disk. So no run uses what it has just
compiled: the first one equals all later ones to the bit.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from numba.core.caching import FunctionCache

from ffr_dyn.integrators import CONTROLLED, METHODS, Integrator
from ffr_dyn.kernels.entry_points import (
    CONTROL_UNITS,
    EXTRA_UNITS,
    LOAD_UNITS,
    RELAXED_UNITS,
    STIFFENED_UNITS,
    UNITS,
    units_of,
)
from ffr_dyn.kernels.tables import Model
from ffr_dyn.kernels.unit import Unit, kernel_named

FORCES = (
    "ffr_dyn.kernels.forces.load:load",
    "ffr_dyn.kernels.forces.spring:spring",
)  # of a scene that is not known yet
_METHODS = {**METHODS, **CONTROLLED}
_AT_WORK: dict[str, subprocess.Popen[bytes]] = {}
_ON_DISK: set[str] = set()  # units that were found there before: a program with many runs looks once


def begin_compiling(*kinds: type[Integrator], model: Model | None = None, forces: Sequence[str] = FORCES) -> None:
    """Start to compile the units of some methods where they are not on disk, and go on with something else meanwhile.

    For programs that mesh and reduce bodies first: a run that needs the units waits for them.

    model : tables of the scene; without them, of one with applied loads
    forces : kernels of the scene's forces, "module:name"
    """
    controlled = CONTROL_UNITS if any(kind.controlled for kind in kinds) else {}
    methods = {name: kind.unit for name, kind in _METHODS.items() if kind in kinds}
    extra = {name: EXTRA_UNITS[name] for kind in kinds for name in kind.calls}
    scene = units_of(model) if model else {**UNITS, **LOAD_UNITS}
    units = {**scene, **controlled, **extra, **methods, **_kept(forces)}
    _ON_DISK.update(name for name, unit in units.items() if name not in _ON_DISK and _is_on_disk(unit))
    missing = [name for name in units if name not in _AT_WORK and name not in _ON_DISK]
    if not missing:
        return
    print("ffr-dyn: compiling the kernels, once (some twenty seconds) ...", file=sys.stderr, flush=True)
    same_packages = {**os.environ, "PYTHONPATH": os.pathsep.join(path or os.getcwd() for path in sys.path)}
    for share in _shares(missing):
        process = subprocess.Popen([sys.executable, "-m", __name__, *share], env=same_packages)
        _AT_WORK.update(dict.fromkeys(share, process))


def _kept(forces: Sequence[str]) -> dict[str, Unit]:
    """The kernels of forces that are kept on disk."""
    return {name: unit for name in forces if (unit := kernel_named(name)).own}


def ensure_compiled(*kinds: type[Integrator], model: Model | None = None, forces: Sequence[str] = ()) -> None:
    """Have the units of some methods on disk; where that fails, the run compiles them itself."""
    begin_compiling(*kinds, model=model, forces=forces)
    for process in set(_AT_WORK.values()):
        process.wait()
    _AT_WORK.clear()


def _shares(names: Sequence[str]) -> list[list[str]]:
    """Two parts that take about as long; `UNITS` lists the long ones first."""
    return [share for share in ([*names[::4], *names[3::4]], [*names[1::4], *names[2::4]]) if share]


def _is_on_disk(unit: Unit) -> bool:
    """Whether numba has stored a compiled form of the unit."""
    folder = Path(FunctionCache(unit.function).cache_path)
    return any(folder.glob(f"*.{unit.function.__name__}-*.nbi"))


def compile_units(names: Sequence[str]) -> None:
    """Compile units and methods by their names."""
    units: dict[str, Unit] = {
        **UNITS,
        **LOAD_UNITS,
        **RELAXED_UNITS,
        **STIFFENED_UNITS,
        **CONTROL_UNITS,
        **EXTRA_UNITS,
        **{name: kind.unit for name, kind in _METHODS.items()},
    }
    for name in names:
        unit = kernel_named(name) if ":" in name else units[name]
        if not unit.address:
            raise RuntimeError(f"unit {name} has no address")


if __name__ == "__main__":
    compile_units(sys.argv[1:])
