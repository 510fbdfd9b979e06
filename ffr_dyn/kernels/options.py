"""How every kernel is compiled, and the care that compiled kernels on disk are never stale.

NaN must survive (it is how a bad force is noticed), so the floating-point liberties are limited to contraction and
re-association. Results are reproducible bit by bit on one machine.

Twin: none, how things are compiled.
"""

from __future__ import annotations

import functools
import os
from pathlib import Path
from typing import Any

from numba import njit

from ffr_dyn.kernels.simd.intrinsics import PLAIN
from ffr_prep.common.compile_cache import check_compiled_code

# No reference counts (_nrt): kernels allocate nothing and return no arrays, and counting views took half of the run time.
OPTIONS: dict[str, Any] = {
    **({} if PLAIN else {"_nrt": False}),
    "error_model": "numpy",
    "fastmath": {"contract", "reassoc", "nsz"},
}

# A kernel that is called from Python with tables of its own; time loops are in `ffr_dyn.kernels.entry_points`.
entry: Any = functools.partial(njit, cache=True, **OPTIONS)

# A kernel that only other kernels call: without the wrappers for callers in Python and C it compiles in half the time.
# Always inlined by the compiler, which is worth a tenth of the run time.
kernel: Any = functools.partial(njit, forceinline=True, no_cpython_wrapper=True, no_cfunc_wrapper=True, **OPTIONS)

# A kernel that is called from one place: numba optimises everything below a compiled function again at each level.
inlined: Any = functools.partial(njit, inline="always", **OPTIONS)

_PACKAGE = Path(__file__).resolve().parent.parent


def _sources() -> list[Path]:
    return sorted([*_PACKAGE.glob("kernels/**/*.py"), *_PACKAGE.glob("integrators/*.py")])


def _stamp() -> str:
    return f"{PLAIN}\n" + "\n".join(
        f"{path.name} {path.stat().st_mtime_ns} {path.stat().st_size}" for path in _sources()
    )


def _compiled() -> list[Path]:
    return [path for folder in ("kernels", "integrators") for path in (_PACKAGE / folder).rglob("__pycache__/*.nb[ic]")]


def discard_stale_kernels() -> None:
    """Delete compiled kernels when any kernel source has changed.

    numba notices a change in a function's own file only; an integrator compiled with an older `bodies.py` would run on.
    Where the package folder cannot be written, or NUMBA_CACHE_DIR says so, numba caches elsewhere: nothing to do.
    """
    if os.environ.get("NUMBA_CACHE_DIR"):
        return
    record = _PACKAGE / "kernels" / "__pycache__" / "sources.stamp"
    try:
        if record.exists() and record.read_text() == _stamp():
            return
        for path in _compiled():
            path.unlink(missing_ok=True)
        record.parent.mkdir(exist_ok=True)
        record.write_text(_stamp())
    except OSError:
        return


discard_stale_kernels()
if not PLAIN:
    check_compiled_code()
