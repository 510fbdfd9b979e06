"""Several models joined to one body at their interfaces: beams or shells to solids, or solids to one another.

A tie makes two interfaces one: both move alike, the second as a rigid continuation of the first where they are not at
the same point. The six coordinates of one of them, a rigid interface or a node, are eliminated,

    z_i = R C_j z,    with R the rigid motion from one point to the other,

so the joined model has the independent coordinates of all parts without these. The interfaces of a tie are no longer
interfaces of the body; all others are.

Source: R. H. MacNeal, The NASTRAN Theoretical Manual (1972), section 5 (elimination of dependent coordinates).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from ffr_prep.body import WITHOUT_SHEAR, Surface
from ffr_prep.body.accelerations import INERTIAL
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.model.coupled import CoupledModel, interface_index
from ffr_prep.model.invariants import InertiaIntegrals
from ffr_prep.model.model import Model, merged, summed
from ffr_prep.model.reactions import known_loads
from ffr_prep.model.region_rotations import second_order_turn
from ffr_prep.model.second_order import SecondOrder
from ffr_prep.pipelines.tied_second_order import Eliminated, tied_second_order
from ffr_prep.solvers.threads import on_one_thread
from ffr_prep.structures.interfaces import rigid_coordinates

_LONG_ARM = 0.1  # of a tie, of the size of the smaller part


@dataclass(frozen=True)
class _End:
    """One end of a tie: its part, the six rows of its coordinates in all of them, and whether they are its own."""

    name: str
    position: Array
    C: sp.csr_array
    own: Array | None


@on_one_thread
def tied(parts: Mapping[str, Model], ties: Sequence[tuple[str, str]]) -> Model:
    """One model of several, joined at pairs of interfaces named "part.interface".

    Of each pair one must be rigid or a node; the other may be mean, which leaves its region soft.

    Raises InputError for an unknown name, an interface in two ties, a tie of two mean interfaces, parts that nothing joins,
    parts with coordinates that have no mass, and names of interfaces that repeat.

    >>> model = fp.tied({"beam": beam, "bracket": bracket}, [("beam.end", "bracket.face")])
    """
    models = list(parts.values())
    _check_ties(parts, ties)
    _check_joined(parts, ties)
    X, steps = elimination(parts, ties)
    coupled = _coupled(parts, ties, X)
    rows = np.split(np.arange(X.shape[0]), np.cumsum([m.coupled.K.shape[0] for m in models])[:-1])
    own = [X[of] for of in rows]

    def stressed(basis: Array) -> Surface | None:
        return merged([m.stressed(x @ basis) for m, x in zip(models, own, strict=True)])

    def inertia(basis: Array) -> InertiaIntegrals:
        return summed([m.inertia(x @ basis) for m, x in zip(models, own, strict=True)])

    def stiffening(static: Array, amplitudes: Array, basis: Array) -> Array:
        of_ties, loads = _through_ties(parts, ties, own, static, amplitudes)
        of_parts = [
            m.stiffening(x @ static, part_loads, x @ basis) for m, part_loads, x in zip(models, loads, own, strict=True)
        ]
        of_arms = [phi.T @ second_order_turn(S) @ phi for S, rotation in of_ties for phi in [rotation @ basis]]
        return np.sum([*of_parts, *of_arms], axis=0)

    def second(basis: Array) -> SecondOrder:
        count, identity = INERTIAL + coupled.C.shape[0], sp.eye_array(X.shape[1], format="csr")
        of_ties, loads = _through_ties(parts, ties, own, identity, np.zeros((count, X.shape[1])))
        known = stiffening(np.zeros((X.shape[1], count)), np.eye(count), basis)
        return tied_second_order(models, X, own, steps, (of_ties, loads), known, basis)

    return Model(
        coupled=coupled,
        inertia=inertia,
        surface=lambda basis: merged([m.surface(x @ basis) for m, x in zip(models, own, strict=True)]),
        stressed=stressed,
        stiffening=stiffening,
        second=second,
        recovery="; ".join(dict.fromkeys(m.recovery for m in models)),
        record=_record(parts, ties),
        doubts=lambda basis: _doubts(parts, [x @ basis for x in own]),
        mesh_energy=lambda basis: _known_sum([m.mesh_energy(x @ basis) for m, x in zip(models, own, strict=True)]),
        damping=lambda basis: _known_sum([m.damping(x @ basis) for m, x in zip(models, own, strict=True)]),
        unstressed=any(m.unstressed for m in models),
    )


def _doubts(parts: Mapping[str, Model], bases: Sequence[Array]) -> list[str]:
    return [f"{name}: {d}" for (name, m), basis in zip(parts.items(), bases, strict=True) for d in m.doubts(basis)]


def _record(parts: Mapping[str, Model], ties: Sequence[tuple[str, str]]) -> dict[str, Any]:
    apart = ("notes", "warnings", WITHOUT_SHEAR)
    return {
        "parts": {name: {k: v for k, v in part.record.items() if k not in apart} for name, part in parts.items()},
        "ties": [list(pair) for pair in ties],
        WITHOUT_SHEAR: [name for part in parts.values() for name in part.record.get(WITHOUT_SHEAR, [])],
        "notes": _of_parts("notes", parts),
        "warnings": [*_of_parts("warnings", parts), *_long_arms(parts, ties)],
    }


def _of_parts(key: str, parts: Mapping[str, Model]) -> list[str]:
    """The notes or warnings of the parts, with their names."""
    return [f"{name}: {said}" for name, part in parts.items() for said in part.record.get(key, [])]


def _long_arms(parts: Mapping[str, Model], ties: Sequence[tuple[str, str]]) -> list[str]:
    """Notes on ties of interfaces that are far from one another: most likely a part lies elsewhere than is meant."""
    notes = []
    for pair in ties:
        sides = [(parts[part].coupled, interface) for part, _, interface in (name.partition(".") for name in pair)]
        one, other = (model.positions[interface_index(model, interface)] for model, interface in sides)
        size = min(np.linalg.norm(np.ptp(model.points, axis=0)) for model, _ in sides)
        if (gap := np.linalg.norm(one - other)) > _LONG_ARM * size:
            notes.append(
                f"{pair[0]!r} and {pair[1]!r} are tied over {gap:.3g} m, by a rigid arm without mass: do both parts lie "
                "where they are meant to? Places are those of their own files, in metres"
            )
    return notes


def _known_sum(parts: Sequence[Array | None]) -> Array | None:
    """Of those parts that know theirs; None of none."""
    known = [part for part in parts if part is not None]
    return np.sum(known, axis=0) if known else None


# ---- loads that pass through ties ---------------------------------------------------------------------------------


def _through_ties(
    parts: Mapping[str, Model],
    ties: Sequence[tuple[str, str]],
    own: Sequence[sp.csr_array],
    static: Array | sp.csr_array,
    loads: Array,
) -> tuple[list[tuple[Array, sp.csr_array]], list[Array]]:
    """The reactions of each tie as (r, 3, 3) force f_a times arm d_b, with the rotation (3, Z) of its arm, and for each part
    the amplitudes (12 + 6 I, r) of its known loads, which are those of the body and of its ties.

    The dependent side of a tie is pulled by what its stiffness and its other loads ask for; the other side by the opposite.
    """
    names, models = list(parts), [part.coupled for part in parts.values()]
    of_parts = _loads_of_parts(models, names, ties, loads)
    arms = []
    for pair in ties:
        sides = [(names.index(part), interface) for part, _, interface in (name.partition(".") for name in pair)]
        places = [(p, interface_index(models[p], interface)) for p, interface in sides]
        if _own(_rows(models, places[0]), 0) is None:
            places.reverse()
        (d, _), (m, _) = places
        rows = _own(_rows(models, places[0]), 0)
        assert rows is not None  # `elimination` has refused the tie otherwise
        z = own[d] @ static
        wrench = np.asarray(models[d].K[rows] @ z - known_loads(models[d])[rows] @ of_parts[d])
        arm = _position(models, places[0]) - _position(models, places[1])
        of_parts[d][_amplitudes(places[0])] += wrench
        of_parts[m][_amplitudes(places[1])] -= np.vstack([wrench[:3], wrench[3:] + np.cross(arm, wrench[:3].T).T])
        arms.append((wrench[:3].T[:, :, None] * arm, sp.csr_array(_rows(models, places[1])[3:] @ own[m])))
    return arms, of_parts


def _loads_of_parts(
    models: Sequence[CoupledModel], names: Sequence[str], ties: Sequence[tuple[str, str]], loads: Array
) -> list[Array]:
    """For each part its known loads (12 + 6 I, r) among those of the body; nothing at ties."""
    gone = {name for pair in ties for name in pair}
    made, first = [], INERTIAL
    for name, model in zip(names, models, strict=True):
        own = np.zeros((INERTIAL + 6 * len(model.names), loads.shape[1]))
        own[:INERTIAL] = loads[:INERTIAL]
        for k, interface in enumerate(model.names):
            if f"{name}.{interface}" not in gone:
                own[_amplitudes((0, k))] = loads[first : first + 6]
                first += 6
        made.append(own)
    return made


def _amplitudes(place: tuple[int, int]) -> slice:
    return slice(INERTIAL + 6 * place[1], INERTIAL + 6 * place[1] + 6)


def _rows(models: Sequence[CoupledModel], place: tuple[int, int]) -> sp.csr_array:
    return models[place[0]].C[6 * place[1] : 6 * place[1] + 6]


def _position(models: Sequence[CoupledModel], place: tuple[int, int]) -> Array:
    return models[place[0]].positions[place[1]]


# ---- elimination --------------------------------------------------------------------------------------------------


def elimination(parts: Mapping[str, Model], ties: Sequence[tuple[str, str]]) -> tuple[sp.csr_array, list[Eliminated]]:
    """X (Z_1 + Z_2 + ..., Z): the coordinates of all parts from the independent ones of the joined model; and tie by tie
    what was eliminated."""
    steps: list[Eliminated] = []
    ends = [(_end(parts, one), _end(parts, other)) for one, other in ties]
    size = sum(part.coupled.K.shape[0] for part in parts.values())
    X = sp.eye_array(size, format="csr")
    kept = np.arange(size)
    for one, other in ends:
        dependent, master = (one, other) if one.own is not None else (other, one)
        if dependent.own is None:
            raise InputError(
                f"interfaces {one.name!r} and {other.name!r} are both mean, so neither has coordinates of its own to tie: "
                "make one of them rigid"
            )
        rigid = rigid_coordinates(dependent.position - master.position)
        follow = rigid @ (master.C @ X)
        columns = np.flatnonzero(np.isin(kept, dependent.own))
        rest = np.flatnonzero(~np.isin(kept, dependent.own))
        _check_apart(dependent, master, follow[:, columns])
        names = master.name.partition(".")
        at = list(parts).index(names[0]), interface_index(parts[names[0]].coupled, names[2])
        steps.append(Eliminated(sp.csr_array(X[:, columns]), master.C, rigid, dependent.position - master.position, at))
        X = X[:, rest] + X[:, columns] @ sp.csr_array(follow[:, rest])
        kept = kept[rest]
    return sp.csr_array(X), steps


def _end(parts: Mapping[str, Model], name: str) -> _End:
    part, _, interface = name.partition(".")
    model = parts[part].coupled
    k = interface_index(model, interface)
    starts = np.cumsum([0, *(p.coupled.K.shape[0] for p in parts.values())])
    first = int(starts[list(parts).index(part)])
    C = model.C[6 * k : 6 * k + 6]
    left, right = sp.csr_array((6, first)), sp.csr_array((6, int(starts[-1]) - first - C.shape[1]))
    return _End(name, model.positions[k], sp.csr_array(sp.hstack([left, C, right])), _own(C, first))


def _own(C: sp.csr_array, first: int) -> Array | None:
    """The columns of an interface that has coordinates of its own, C being the identity there; else None."""
    here = C.tocoo()
    order = np.argsort(here.row)
    alone = here.nnz == 6 and np.array_equal(here.row[order], np.arange(6)) and (here.data == 1.0).all()
    return first + here.col[order] if alone else None


def _coupled(parts: Mapping[str, Model], ties: Sequence[tuple[str, str]], X: sp.csr_array) -> CoupledModel:
    models = [part.coupled for part in parts.values()]
    points = np.vstack([m.points for m in models])
    centre = points.mean(axis=0)
    gone = {name for pair in ties for name in pair}
    stay = [[f"{part}.{name}" not in gone for name in parts[part].coupled.names] for part in parts]
    rows = _independent_rows(X)
    return CoupledModel(
        points=points,
        B=_diagonal([m.B for m in models]) @ X,
        K=sp.csr_array(X.T @ _diagonal([m.K for m in models]) @ X),
        M=sp.csr_array(X.T @ _diagonal([m.M for m in models]) @ X),
        T=np.vstack([_about(m, centre) for m in models])[rows],
        centre=centre,
        places=np.vstack([m.places for m in models])[rows],
        names=tuple(n for m, keep in zip(models, stay, strict=True) for n, k in zip(m.names, keep, strict=True) if k),
        kinds=tuple(n for m, keep in zip(models, stay, strict=True) for n, k in zip(m.kinds, keep, strict=True) if k),
        positions=np.vstack([m.positions for m in models])[np.concatenate(stay).astype(bool)],
        C=sp.csr_array((_diagonal([m.C for m in models]) @ X)[np.repeat(np.concatenate(stay).astype(bool), 6)]),
        inertial_loads=X.T @ np.vstack([known_loads(m)[:, :INERTIAL] for m in models]),
        edges=_edges(models),
        dimension=max(m.dimension for m in models),
    )


def _edges(models: Sequence[CoupledModel]) -> Array | None:
    """The edges of all models among all their points; None where one does not know its elements."""
    first = np.cumsum([0, *(len(m.points) for m in models)])
    known = [m.edges + start for m, start in zip(models, first, strict=False) if m.edges is not None]
    return np.concatenate(known) if len(known) == len(models) else None


def _independent_rows(X: sp.csr_array) -> Array:
    """(Z,) for each independent coordinate, the row of all coordinates that is it."""
    single = np.flatnonzero(np.diff(X.indptr) == 1)
    row_of = np.full(X.shape[1], -1)
    row_of[X.indices[X.indptr[single]][::-1]] = single[::-1]
    return row_of


def _about(model: CoupledModel, centre: Array) -> Array:
    """(Z, 6) the rigid motions with rotations about another centre."""
    return model.T @ rigid_coordinates(model.centre - centre)


def _diagonal(matrices: Sequence[sp.sparray]) -> sp.csr_array:
    return sp.csr_array(sp.block_diag(matrices, format="csr"))


# ---- guards -------------------------------------------------------------------------------------------------------


def _check_ties(parts: Mapping[str, Model], ties: Sequence[tuple[str, str]]) -> None:
    uses: dict[str, int] = {}
    for name in (name for pair in ties for name in pair):
        part, dot, interface = name.partition(".")
        if part not in parts or not dot:
            raise InputError(f"tie of {name!r}: write PART.INTERFACE; the parts are {', '.join(map(repr, parts))}")
        interface_index(parts[part].coupled, interface)
        uses[name] = uses.get(name, 0) + 1
    twice = [name for name, count in uses.items() if count > 1]
    if twice:
        raise InputError(f"interface {twice[0]!r} is in {uses[twice[0]]} ties: give each tie an interface of its own")
    massless = [name for name, part in parts.items() if part.massless]
    if massless:
        raise InputError(
            f"some coordinates of the part {massless[0]!r} have no mass: give them a little rotary inertia, or reduce it "
            "alone"
        )
    left = [n for part, m in parts.items() for n in m.coupled.names if f"{part}.{n}" not in uses]
    repeated = sorted({name for name in left if left.count(name) > 1})
    if repeated:
        raise InputError(f"interface name {repeated[0]!r} is in more than one part: give them names of their own")


def _check_apart(dependent: _End, master: _End, on_itself: Array) -> None:
    if np.abs(on_itself).max(initial=0.0) > 0:
        raise InputError(f"interfaces {dependent.name!r} and {master.name!r} move one another: separate their regions")


def _check_joined(parts: Mapping[str, Model], ties: Sequence[tuple[str, str]]) -> None:
    names = list(parts)
    pairs = [[names.index(end.partition(".")[0]) for end in pair] for pair in ties]
    rows, columns = np.array(pairs, int).reshape(-1, 2).T
    graph = sp.coo_array((np.ones(len(rows)), (rows, columns)), shape=(len(names), len(names)))
    count, labels = connected_components(graph, directed=False)
    if count > 1:
        groups = [[name for name, of in zip(names, labels, strict=True) if of == one] for one in range(count)]
        listed = " to ".join(" and ".join(map(repr, group)) for group in groups)
        raise InputError(f"nothing joins {listed}: tie an interface of one to one of the other")
