"""The model that outside matrices make: nodes, stiffness, mass and the map between rows and nodal coordinates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from ffr_prep.body import content_hash
from ffr_prep.common.arrays import Array
from ffr_prep.common.brief import Brief, Rows, listed
from ffr_prep.common.errors import InputError
from ffr_prep.common.in_words import extent_in_words
from ffr_prep.matrices.nodal_inertia import DofMap
from ffr_prep.matrices.unit_systems import UnitSystem
from ffr_prep.mesh.geometry.node_regions import nodes_of_region

_FAR = 1e100  # m; squares of coordinates must be finite
_SAME_PLACE = 1e-6
_SHOWN = 5
_COMPONENTS = (
    "translation along x",
    "translation along y",
    "translation along z",
    "rotation about x",
    "rotation about y",
    "rotation about z",
)


@dataclass(frozen=True, repr=False)
class MatrixModel(Brief):
    """Nodes, stiffness and mass of a free body, from outside; frozen, SI units.

    points     : (N, 3) nodes [m]
    K, M       : (D, D) stiffness [N/m, N, N m] and mass [kg, kg m, kg m^2]
    nodes      : (D,) index of the node of each row
    components : (D,) 0, 1, 2 translation along x, y, z; 3, 4, 5 rotation about x, y, z; axes of the body
    labels     : (N,) numbers of the nodes in the file, for messages; 1, 2, ... when not given
    groups     : name -> (m,) indices of nodes, where interfaces attach
    triangles  : (T, 3) indices of nodes, a surface to draw; None without one
    source     : where it comes from, plain JSON values
    notes      : what was left out or changed on reading, in words
    C          : (D, D) viscous damping [N s/m, N s, N m s], symmetric; None where there is none

    Raises InputError when sizes, rows and nodes do not fit each other.

    >>> model = fp.read_matrices(["part.npz"])
    """

    points: Array
    K: sp.csr_array
    M: sp.csr_array
    nodes: Array
    components: Array
    labels: Array = field(default_factory=lambda: np.zeros(0, np.int64))
    groups: Mapping[str, Array] = field(default_factory=dict)
    triangles: Array | None = None
    source: Mapping[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    C: sp.csr_array | None = None

    def __post_init__(self) -> None:
        for key, kind in (("points", float), ("nodes", np.int64), ("components", np.int64)):
            object.__setattr__(self, key, np.array(getattr(self, key), kind))
        labels = np.array(self.labels, np.int64)
        labels = labels if labels.size else np.arange(1, len(self.points) + 1)
        object.__setattr__(self, "labels", labels)
        for key in ("K", "M"):
            object.__setattr__(self, key, _real(key, sp.csr_array(getattr(self, key))))
        if self.C is not None:
            object.__setattr__(self, "C", _real("C", sp.csr_array(self.C)))
        object.__setattr__(self, "groups", {name: np.array(of, np.int64) for name, of in self.groups.items()})
        if self.triangles is not None:
            object.__setattr__(self, "triangles", np.array(self.triangles, np.int64).reshape(-1, 3))
        _check_shapes(self)
        _check_rows(self)

    def _rows(self) -> Rows:
        return [
            ("rows", f"{len(self.nodes)}, {self.K.nnz} entries in K, {self.M.nnz} in M"),
            ("nodes", str(len(self.points))),
            ("extent", extent_in_words(self.points)),
            ("groups", listed(self.groups)),
            ("source", str(self.source.get("format", "unknown"))),
            ("notes", listed(self.notes)),
        ]

    @property
    def matrices(self) -> dict[str, sp.csr_array]:
        """Those that there are, by name."""
        named = {"K": self.K, "M": self.M}
        return named if self.C is None else {**named, "C": self.C}

    @property
    def dofs(self) -> DofMap:
        """The map between rows and the coordinates of the nodes."""
        return DofMap(self.nodes, self.components, len(self.points))


def row_in_words(model: MatrixModel, row: int) -> str:
    """Node and coordinate of a row."""
    return f"{component_in_words(model.components[row])} of {node_in_words(model, model.nodes[row])}"


def node_in_words(model: MatrixModel, node: int) -> str:
    """Label and place of a node."""
    at = ", ".join(f"{x:.4g}" for x in model.points[node])
    return f"node {model.labels[node]} at ({at}) m"


def component_in_words(component: int) -> str:
    """The name of a nodal coordinate 0 ... 5."""
    return _COMPONENTS[component]


def model_hash(model: MatrixModel) -> str:
    """A short hash of nodes, matrices and map."""
    sparse = [part for A in model.matrices.values() for part in (A.indptr, A.indices, A.data)]
    return content_hash(model.points, model.nodes, model.components, *sparse)


# ---- changes ------------------------------------------------------------------------------------------------------


def in_si(model: MatrixModel, units: UnitSystem) -> MatrixModel:
    """The model with numbers in `units` converted to SI.

    With lengths in the unit L the nodal coordinates are u = L u' for translations and the same for rotations, and the
    energies u^T K u in the unit mass L^2 / time^2 stay what they are.
    """
    scale = np.where(model.components < 3, 1 / units.length, 1.0)
    inertia = units.mass * units.length**2
    S = sp.diags_array(scale)
    return replace(
        model,
        points=model.points * units.length,
        K=sp.csr_array(inertia / units.time**2 * (S @ model.K @ S)),
        M=sp.csr_array(inertia * (S @ model.M @ S)),
        C=None if model.C is None else sp.csr_array(inertia / units.time * (S @ model.C @ S)),
    )


def without_empty_rows(model: MatrixModel) -> MatrixModel:
    """Without rows that have neither stiffness nor mass, and without nodes that are left with no row.

    Programs that give six coordinates to every node leave the rotations of solids empty.
    """
    largest = np.maximum(_row_sizes(model.K), _row_sizes(model.M))
    kept = np.flatnonzero(largest > 0)
    if kept.size == len(model.nodes) and np.unique(model.nodes).size == len(model.points):
        return model
    used = np.unique(model.nodes[kept])
    new = np.full(len(model.points), -1)
    new[used] = np.arange(used.size)
    groups = {name: new[of][new[of] >= 0] for name, of in model.groups.items()}
    if model.triangles is not None and (new[model.triangles] < 0).any():
        lost = int(model.triangles[new[model.triangles] < 0][0])
        raise InputError(
            f"the surface has {node_in_words(model, lost)}, which has no row in the matrices: leave its triangles out, or "
            "give the matrices of all its nodes"
        )
    return MatrixModel(
        points=model.points[used],
        K=sp.csr_array(model.K[kept][:, kept]),
        M=sp.csr_array(model.M[kept][:, kept]),
        nodes=new[model.nodes[kept]],
        components=model.components[kept],
        labels=model.labels[used],
        groups={name: of for name, of in groups.items() if of.size},
        triangles=None if model.triangles is None else new[model.triangles],
        source=model.source,
        notes=(*model.notes, *_dropped(model, kept, used)),
        C=None if model.C is None else sp.csr_array(model.C[kept][:, kept]),
    )


def _row_sizes(A: sp.csr_array) -> Array:
    """(D,) the largest entry of each row."""
    return np.asarray(abs(A).max(axis=1).todense()).ravel()


def _dropped(model: MatrixModel, kept: Array, used: Array) -> list[str]:
    rows, nodes = len(model.nodes) - kept.size, len(model.points) - used.size
    notes = [f"{rows} rows without stiffness and mass are left out"] if rows else []
    return notes + ([f"{nodes} nodes without rows are left out"] if nodes else [])


def with_group(model: MatrixModel, name: str, labels: Sequence[int]) -> MatrixModel:
    """The model with a name for the nodes of these numbers; InputError for a number that no node has.

    >>> model = fp.with_group(model, "tip", [101, 102])
    """
    index = {label: k for k, label in enumerate(model.labels.tolist())}
    missing = [label for label in labels if label not in index]
    if missing:
        raise InputError(f"group {name!r}: there is no node {missing[0]}; {_labels_in_words(model)}")
    return replace(model, groups={**model.groups, name: np.unique([index[label] for label in labels])})


def with_node(model: MatrixModel, name: str, position: Sequence[float]) -> MatrixModel:
    """The model with a name for the node at this position (3,) [m]; InputError where there is none.

    >>> model = fp.with_node(model, "tip", (1.0, 0, 0))
    """
    if not np.abs(np.asarray(position, float)).max() < _FAR:
        raise InputError(f"group {name!r}: a node cannot be at {tuple(position)} m; give a place of finite coordinates")
    distance, node = cKDTree(model.points).query(np.asarray(position, float))
    if not distance <= _SAME_PLACE * np.linalg.norm(np.ptp(model.points, axis=0)):
        raise InputError(
            f"group {name!r}: there is no node at {tuple(position)} m; the nearest is "
            f"{node_in_words(model, int(node))}, {distance:.3g} m away"
        )
    return replace(model, groups={**model.groups, name: np.array([node])})


def with_surface(model: MatrixModel, points: Array, triangles: Array) -> MatrixModel:
    """The model with a surface to draw: triangles (T, 3) on points (P, 3) [m], each of which is at a node.

    Raises InputError for a point that is at no node.

    >>> model = fp.with_surface(model, points, triangles)
    """
    used, local = np.unique(triangles, return_inverse=True)
    distance, node = cKDTree(model.points).query(points[used])
    far = int(np.argmax(distance))
    if distance[far] > _SAME_PLACE * np.linalg.norm(np.ptp(model.points, axis=0)):
        raise InputError(
            f"the surface does not fit the nodes: its point {points[used][far].tolist()} m is {distance[far]:.3g} m away "
            "from the nearest of them; give the mesh of the same model, in the right unit"
        )
    return replace(model, triangles=node[local].reshape(-1, 3))


def group_nodes(model: MatrixModel, name: str) -> Array:
    """(m,) nodes of a group, or of a region such as "nearest 0,0,1", ascending; InputError lists the groups there are."""
    hint = "" if model.groups else "; name nodes by number or position"
    return nodes_of_region(model.points, model.groups, name, "there is no group of nodes", hint)


def _real(name: str, A: sp.csr_array) -> sp.csr_array:
    if np.iscomplexobj(A.data):
        raise InputError(f"{name} is complex; give its real part: viscous damping is a matrix of its own, C")
    return sp.csr_array(A, dtype=float)


# ---- guards -------------------------------------------------------------------------------------------------------


def _check_shapes(model: MatrixModel) -> None:
    if model.points.ndim != 2 or model.points.shape[1] != 3:
        raise InputError(f"nodes have the shape {model.points.shape}; they must be (N, 3): x, y, z of every node")
    rows = len(model.nodes)
    for name, A in model.matrices.items():
        if A.shape != (rows, rows):
            raise InputError(
                f"{name} is {A.shape[0]} x {A.shape[1]}, but the table of nodal coordinates has {rows} rows: both must "
                "come from the same set of degrees of freedom"
            )
        if not np.isfinite(A.data).all():
            raise InputError(f"{name} holds values that are not finite numbers")
    if not np.abs(model.points).max(initial=0.0) < _FAR:
        wrong = int(np.flatnonzero(~(np.abs(model.points) < _FAR).all(axis=1))[0])
        raise InputError(f"node {model.labels[wrong]} has coordinates that are not finite numbers, below {_FAR:g} m")
    if model.labels.shape != (len(model.points),):
        raise InputError(f"there are {len(model.points)} nodes, but {np.size(model.labels)} labels for them")


def _check_rows(model: MatrixModel) -> None:
    if model.components.shape != model.nodes.shape:
        raise InputError(f"{model.nodes.size} rows have a node, but {model.components.size} have a component")
    strange = np.flatnonzero((model.nodes < 0) | (model.nodes >= len(model.points)))
    if strange.size:
        raise InputError(
            f"row {strange[0] + 1} belongs to node index {model.nodes[strange[0]]}; there are {len(model.points)} nodes"
        )
    strange = np.flatnonzero((model.components < 0) | (model.components > 5))
    if strange.size:
        raise InputError(
            f"row {strange[0] + 1} is coordinate {model.components[strange[0]] + 1} of its node; nodes have 1 to 6 "
            "(temperature and pressure do not belong into a mechanical model)"
        )
    keys = 6 * model.nodes + model.components
    order = np.argsort(keys, kind="stable")
    again = np.flatnonzero(np.diff(keys[order]) == 0)
    if again.size:
        one, two = sorted(order[again[0] : again[0] + 2])
        raise InputError(f"rows {one + 1} and {two + 1} are both {row_in_words(model, one)}: every row needs its own")
    _check_references(model)


def _check_references(model: MatrixModel) -> None:
    for name, of in [*model.groups.items(), ("surface", model.triangles)]:
        if of is not None and of.size and (of.min() < 0 or of.max() >= len(model.points)):
            raise InputError(f"{name!r} names node index {of.max()}, but there are {len(model.points)} nodes")


def _labels_in_words(model: MatrixModel) -> str:
    labels = model.labels.tolist()
    shown = ", ".join(map(str, labels[:_SHOWN]))
    return f"the {len(labels)} nodes are {shown}{', ...' if len(labels) > _SHOWN else ''}"
