"""Entry points: functions that are compiled once, each on its own, and call one another by address.

An integrator, and whatever else one function calls, would otherwise be compiled again together with everything below it. The
addresses are numbers in `Tables.entry_points`, one place for each entry point; what a place holds is chosen when an engine is
made, so that a scene may have a form of its own of some functions.

The declaration says it all once: `entry_point` above a function with annotated arguments makes its C signature, its number,
its place among the addresses, and the calls: in compiled code and from Python alike, `name(r, ...)`, r the tables.
"""

from __future__ import annotations

import ctypes
import inspect
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any, get_type_hints

import numpy as np
from llvmlite import ir
from numba import cfunc, types
from numba.extending import lower_builtin, type_callable

from ffr_dyn.kernels.options import OPTIONS
from ffr_dyn.kernels.simd.table_address import Packed, address_of, pack, place_of
from ffr_dyn.kernels.tables import Model, Record, Tables, Vector

# By an argument's annotation: its type in compiled code and in C. A vector is the address of its first number.
_KINDS: dict[Any, tuple[Any, Any]] = {
    Tables: (Packed(Tables), ctypes.c_void_p),
    Record: (Packed(Record), ctypes.c_void_p),
    Vector: (types.CPointer(types.float64), ctypes.c_void_p),
    float: (types.float64, ctypes.c_double),
    int: (types.int64, ctypes.c_int64),
}
_WORD = ir.IntType(64)


class CompiledFunction:
    """A function of annotated arguments, the first the tables, that returns a status; compiled when its address is first
    asked for, or read from disk.

    Those of other packages are compiled anew by every process: nobody would notice that one on disk is older than the kernels
    it was compiled with.
    """

    def __init__(self, function: Callable[..., int]) -> None:
        self.function = function
        self.name = function.__name__

    @property
    def own(self) -> bool:
        """Whether it is of this package, and kept on disk."""
        return self.function.__module__.startswith("ffr_dyn.")

    @cached_property
    def kinds(self) -> list[tuple[Any, Any]]:
        """Of all arguments."""
        hints = get_type_hints(self.function)
        return [
            _KINDS[hints[name]] for name in self.function.__code__.co_varnames[: self.function.__code__.co_argcount]
        ]

    @cached_property
    def compiled(self) -> Any:
        return cfunc(types.int64(*(kind for kind, _ in self.kinds)), cache=self.own, **OPTIONS)(self.function)

    @cached_property
    def address(self) -> int:
        return int(self.compiled.address)

    @cached_property
    def c_function(self) -> Callable[..., int]:
        """For calls from Python, with addresses in place of tables, records and vectors. Other threads go on meanwhile."""
        return ctypes.CFUNCTYPE(ctypes.c_int64, *(kind for _, kind in self.kinds))(self.address)

    @cached_property
    def short_call(self) -> Callable[..., int]:
        """The same for calls of microseconds: to let go of Python's lock, and to ask for it again, takes longer."""
        return ctypes.PYFUNCTYPE(ctypes.c_int64, *(kind for _, kind in self.kinds))(self.address)


class EntryPoint:
    """A function with a place among the addresses, and the forms of it that stand there for some scenes."""

    def __init__(self, function: Callable[..., int], number: int, needed: Callable[[Model], bool]) -> None:
        self.general = CompiledFunction(function)
        self.number, self.needed = number, needed
        self.forms: list[tuple[Callable[[Model], bool], CompiledFunction]] = []
        _make_callable(self)

    def where(self, suits: Callable[[Model], bool]) -> Callable[[Callable[..., int]], CompiledFunction]:
        """The decorator of a form of the function, with the same arguments, for the scenes that it suits."""

        def add(function: Callable[..., int]) -> CompiledFunction:
            self.forms.append((suits, CompiledFunction(function)))
            return self.forms[-1][1]

        return add

    def chosen(self, model: Model) -> CompiledFunction:
        """The function that stands in the place for a scene."""
        return next((form for suits, form in self.forms if suits(model)), self.general)

    def __call__(self, tables: Tables, *arguments: Any) -> int:
        """One evaluation from Python: the form of the scene. Vectors are contiguous arrays of float64."""
        packed = [pack(each) if isinstance(each, tuple) else each for each in arguments]  # which live until it returns
        given = [address_of(each) if isinstance(each, np.ndarray) else each for each in packed]
        return self.chosen(tables.model).short_call(tables.address, *given)


ENTRY_POINTS: dict[str, EntryPoint] = {}


def always(model: Model) -> bool:
    return True


def entry_point(needed: Callable[[Model], bool] = always) -> Callable[[Callable[..., int]], EntryPoint]:
    """The decorator of an entry point. All stand in one module, which makes their numbers the same in every process.

    needed : whether a scene needs it
    """

    def declare(function: Callable[..., int]) -> EntryPoint:
        return ENTRY_POINTS.setdefault(function.__name__, EntryPoint(function, len(ENTRY_POINTS), needed))

    return declare


def _make_callable(entry: EntryPoint) -> None:
    """Let numba type and compile calls of an entry point."""

    @type_callable(entry)
    def typed(context):  # type: ignore[no-untyped-def]
        def returned(*given: Any) -> Any:
            return types.int64

        returned.__signature__ = inspect.signature(entry.general.function)  # type: ignore[attr-defined]
        return returned

    @lower_builtin(entry, types.VarArg(types.Any))
    def call(context, builder, sig, args):  # type: ignore[no-untyped-def]
        kinds = [kind for kind, _ in entry.general.kinds]
        given = [_as_kind(context, builder, *each) for each in zip(args, sig.args, kinds, strict=True)]
        words = builder.bitcast(args[0], _WORD.as_pointer())
        places = builder.load(builder.gep(words, [_WORD(place_of(Tables, "entry_points"))]))
        at = builder.gep(builder.inttoptr(places, _WORD.as_pointer()), [_WORD(entry.number)])
        return _call_at(builder, builder.load(at), given)


def call_like(function: Callable[..., int]) -> Any:
    """call(address, *arguments) in compiled code, which calls what is at an address with the arguments of `function`."""
    kinds = [kind for kind, _ in CompiledFunction(function).kinds]
    address = inspect.Parameter("address", inspect.Parameter.POSITIONAL_OR_KEYWORD)

    def call(*address_and_arguments: Any) -> int:
        raise NotImplementedError("for compiled code alone")

    @type_callable(call)
    def typed(context):  # type: ignore[no-untyped-def]
        def returned(*given: Any) -> Any:
            return types.int64

        parameters = [address, *inspect.signature(function).parameters.values()]
        returned.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
        return returned

    @lower_builtin(call, types.VarArg(types.Any))
    def lowered(context, builder, sig, args):  # type: ignore[no-untyped-def]
        given = [_as_kind(context, builder, *each) for each in zip(args[1:], sig.args[1:], kinds, strict=True)]
        return _call_at(builder, args[0], given)

    return call


def _call_at(builder: Any, address: Any, given: Sequence[Any]) -> Any:
    function = ir.FunctionType(_WORD, [value.type for value in given])
    return builder.call(builder.inttoptr(address, function.as_pointer()), given)


def _as_kind(context: Any, builder: Any, value: Any, given: Any, wanted: Any) -> Any:
    """A value of one type of numba as one of another: an array as the address of its data."""
    if isinstance(given, types.Array):
        return context.make_helper(builder, given, value).data
    return value if given == wanted else context.cast(builder, value, given, wanted)
