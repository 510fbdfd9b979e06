"""Which faces a region means (`ffr_prep.mesh.region_words` says what may be written)."""

from __future__ import annotations

import fnmatch
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.common.registry import choice
from ffr_prep.mesh.faces import METRES, Face, Faces, feature_centre, feature_in_words, same_surface, tidy
from ffr_prep.mesh.region_words import Names, Query, is_query, parsed

_SAME = 1e-4  # within which a number that was typed is met, relatively
_SHOWN = 6


def found(faces: Faces, region: str) -> tuple[int, ...]:
    """The numbers of the faces that a region means, such as "cylinder r=6mm at 0,0,0", "surface_1..4" or "bore*+plane z=0".

    Raises InputError for a text that is no region, for one that finds nothing and for one that finds several surfaces without
    saying "all"; the message tells what is near and what to type.
    """
    whole = _by_name(faces, region)
    terms = (Names(region, (region,)),) if whole else parsed(region, faces.unit)
    hits = [_of_query(faces, term) if isinstance(term, Query) else _of_names(faces, term) for term in terms]
    return tuple(dict.fromkeys(k for of in hits for k in of))


def pieces(faces: Faces, chosen: Sequence[int]) -> list[tuple[int, ...]]:
    """The features that chosen faces belong to, of each the faces that are chosen."""
    within = [tuple(k for k in feature if k in set(chosen)) for feature in faces.features]
    return [of for of in within if of]


# ---- by name --------------------------------------------------------------------------------------------------------


def names_of(face: Face) -> tuple[str, ...]:
    """All names by which a face is a region: its own, its label, its groups."""
    return tuple(name for name in (face.name, face.label, *face.groups) if name)


def _by_name(faces: Faces, name: str) -> list[int]:
    return [k for k, face in enumerate(faces.faces) if name in names_of(face)]


def _of_names(faces: Faces, term: Names) -> list[int]:
    if term.pattern and not _by_name(faces, term.text):
        hits = [k for k, f in enumerate(faces.faces) if any(fnmatch.fnmatchcase(n, term.text) for n in names_of(f))]
        if not hits:
            raise InputError(f"no face has a name like {term.text!r}; {_known(faces, term.text)}")
        return hits
    hits = []
    for name in term.names:
        of = _by_name(faces, name)
        if not of:
            raise InputError(f"there is no face {name!r}; {_known(faces, name)}")
        hits += of
    return hits


def _known(faces: Faces, name: str) -> str:
    return (
        f"{choice(name, dict.fromkeys(known for face in faces.faces for known in names_of(face)))}. Faces are also found by "
        "what they are, such as 'cylinder r=6mm at 0,0,0' or 'plane z=0'"
    )


# ---- by query -------------------------------------------------------------------------------------------------------


def _of_query(faces: Faces, query: Query) -> list[int]:
    meant = _meant(faces, query)
    if not meant:
        raise InputError(f"{query.text!r} finds no face. {_what_is_near(faces, query)}")
    if len(meant) == 1:
        return meant[0]
    shown = "\n".join(_offer(faces, of) for of in meant[:_SHOWN])
    more = f"\n  and {len(meant) - _SHOWN} more" if len(meant) > _SHOWN else ""
    if query.near is not None:
        raise InputError(f"{query.text!r}: these are equally near; write one, or several joined by +:\n{shown}{more}")
    raise InputError(
        f"{query.text!r} finds {len(meant)} {query.kind}s; write 'all {query.text}' for all of them, or one:\n{shown}{more}"
    )


def _meant(faces: Faces, query: Query) -> list[list[int]]:
    """The faces of each surface that fits, or of the features that are equally near; one where the query is clear."""
    fitting = [k for k, face in enumerate(faces.faces) if _misfit(faces, face, query) <= 1]
    if not fitting:
        return []
    if query.near is not None:
        return _nearest(faces, query, fitting)
    return [fitting] if query.every else _surfaces(faces, fitting)


def _surfaces(faces: Faces, chosen: Sequence[int]) -> list[list[int]]:
    """The chosen faces by the surface that they lie on."""
    groups: list[list[int]] = []
    for k in chosen:
        for group in groups:
            if same_surface(faces.faces[group[0]], faces.faces[k], faces.tolerance * faces.size):
                group.append(k)
                break
        else:
            groups.append([k])
    return groups


def _nearest(faces: Faces, query: Query, fitting: Sequence[int]) -> list[list[int]]:
    """Of the features of fitting faces those that are nearest to the point of the query."""
    features = [[k for k in of if k in set(fitting)] for of in faces.features]
    features = [of for of in features if of]
    point = np.array(query.near)
    distances = np.array([min(_distance(faces, k, point) for k in of) for of in features])
    order = np.argsort(distances, kind="stable")
    tied = [features[k] for k in order if distances[k] - distances[order[0]] <= faces.tolerance * faces.size]
    if distances[order[0]] > faces.size:
        scale = METRES[faces.unit]
        raise InputError(
            f"{query.text!r}: the point is {distances[order[0]] / scale:.4g} {faces.unit} away from the body, whose size is "
            f"{faces.size / scale:.4g} {faces.unit}; numbers without a unit are {faces.unit}{_thousand(faces, query)}"
        )
    return tied


def _misfit(faces: Faces, face: Face, query: Query) -> float:
    """How far a face is from what is asked: at most 1 where it fits, infinite for another kind."""
    kind = "cylinder" if query.kind == "bore" else query.kind
    if face.inner or kind not in ("face", face.kind) or (query.kind == "bore" and face.hollow is False):
        return np.inf
    worst = 0.0
    if query.radius is not None:
        if face.radius is None or face.kind == "cone":
            return np.inf
        worst = abs(face.radius - query.radius) / max(_SAME * query.radius, faces.tolerance * faces.size)
    if query.colour and face.colour != query.colour:
        return np.inf
    for wanted, signed in ((query.normal, True), (query.axis, False)):
        worst = max(worst, _turned(face, wanted, signed))
    if query.through is not None:
        worst = max(worst, _across(faces, face, *query.through))
    if query.at is not None:
        worst = max(worst, _off(face, np.array(query.at)) / (faces.tolerance * faces.size))
    return worst


def _turned(face: Face, wanted: Sequence[float] | None, signed: bool) -> float:
    """How far the normal (signed) or axis is from a direction."""
    if wanted is None:
        return 0.0
    if face.axis is None or signed != (face.kind == "plane"):
        return np.inf
    unit = np.array(wanted) / np.linalg.norm(wanted)
    return np.inf if signed and unit @ face.axis < 0 else float(np.linalg.norm(np.cross(unit, face.axis))) / 1e-3


def _across(faces: Faces, face: Face, axis: int, place: float) -> float:
    """How far a plane is from one across an axis of coordinates at a place."""
    if face.kind != "plane" or face.axis is None or face.point is None:
        return np.inf
    tilt = np.linalg.norm(np.delete(face.axis, axis))
    return (
        np.inf
        if tilt > 1e-3
        else abs(face.point[axis] - place) / max(faces.tolerance * faces.size, _SAME * abs(place) / 10)
    )


def _off(face: Face, point: Array) -> float:
    """Distance of a point from a plane, from an axis, from a centre [m]."""
    if face.point is None:
        return np.inf
    arm = point - face.point
    if face.kind == "plane" and face.axis is not None:
        return float(abs(arm @ face.axis))
    if face.kind in ("cylinder", "cone") and face.axis is not None:
        return float(np.linalg.norm(np.cross(arm, face.axis)))
    return float(np.linalg.norm(arm))


def _distance(faces: Faces, k: int, point: Array) -> float:
    """Distance of a point from the triangles of a face [m]."""
    a, b, c = np.moveaxis(faces.points[faces.triangles[k]], 1, 0)
    normal = np.cross(b - a, c - a)
    length = np.maximum(np.linalg.norm(normal, axis=1), np.finfo(float).tiny)
    height = ((point - a) * normal).sum(axis=1) / length
    foot = point - height[:, None] * normal / length[:, None]
    inside = np.ones(len(a), bool)
    edges = np.full(len(a), np.inf)
    for p, q in ((a, b), (b, c), (c, a)):
        along = q - p
        inside &= (np.cross(along, foot - p) * normal).sum(axis=1) >= 0
        share = ((point - p) * along).sum(axis=1) / np.maximum((along**2).sum(axis=1), np.finfo(float).tiny)
        edges = np.minimum(edges, np.linalg.norm(point - p - np.clip(share, 0, 1)[:, None] * along, axis=1))
    return float(np.where(inside, np.abs(height), edges).min())


# ---- what is near, and what to type ---------------------------------------------------------------------------------


def _what_is_near(faces: Faces, query: Query) -> str:
    """The features that come closest, each with what to type."""
    kind = "cylinder" if query.kind == "bore" else query.kind
    outer = [f for f in faces.features if not faces.faces[f[0]].inner]
    of_kind = [f for f in outer if kind in ("face", faces.faces[f[0]].kind)]
    if not of_kind:
        kinds = dict.fromkeys(face.kind for face in faces.faces)
        return f"There is no {query.kind} at all; there are: {', '.join(kinds)}. `ffr-prep faces FILE` lists them"
    loose = replace(query, through=None, at=None, near=None)
    misfits = [min(_misfit(faces, faces.faces[f[0]], q) for q in (query, loose)) for f in of_kind]
    apart = [_apart(faces, f, query) for f in of_kind]
    order = sorted(range(len(of_kind)), key=lambda k: (misfits[k], apart[k]))[:_SHOWN]
    shown = "\n".join(_offer(faces, of_kind[k]) for k in order)
    return f"Near are{_thousand(faces, query)}:\n{shown}"


def _apart(faces: Faces, feature: Sequence[int], query: Query) -> float:
    face = faces.faces[feature[0]]
    point = query.at or query.near
    if point is not None:
        return _off(face, np.array(point))
    if query.through is not None and face.point is not None and face.axis is not None:
        axis, place = query.through
        return float(abs(face.point[axis] - place)) if abs(face.axis[axis]) > 1 - 1e-6 else np.inf
    return 0.0


def _thousand(faces: Faces, query: Query) -> str:
    """A hint where the numbers would fit a thousand times larger or smaller."""
    for factor, unit in ((1e-3, "mm"), (1e3, "m")):
        scaled = replace(
            query,
            radius=query.radius and query.radius * factor,
            through=query.through and (query.through[0], query.through[1] * factor),
            at=query.at and tuple(factor * x for x in query.at),  # type: ignore[arg-type]
            near=query.near and tuple(factor * x for x in query.near),  # type: ignore[arg-type]
        )
        if scaled == query:
            continue
        hit = any(_misfit(faces, face, scaled) <= 1 for face in faces.faces)
        reached = (
            scaled.near is None
            or min(_distance(faces, k, np.array(scaled.near)) for k in range(len(faces))) < faces.size
        )
        if hit and reached:
            meant = f", so write {unit} behind the numbers" if faces.unit != unit else ""
            return f" (a factor of a thousand would make it fit{meant})"
    return ""


def _offer(faces: Faces, feature: Sequence[int]) -> str:
    return f"  {query_for(faces, feature)}    ({feature_in_words(faces, feature)})"


def query_for(faces: Faces, feature: Sequence[int]) -> str:
    """What to type for the faces of a feature: a query that finds them and no other, or their names."""
    wanted = set(feature)
    for text in _candidates(faces, feature):
        (term,) = parsed(text, faces.unit)
        hits = _meant(faces, term) if isinstance(term, Query) else [_by_name(faces, text)]
        if len(hits) == 1 and set(hits[0]) == wanted:
            return text
    return "+".join(faces.faces[k].name for k in feature)


def _candidates(faces: Faces, feature: Sequence[int]) -> list[str]:
    face, scale, unit = faces.faces[feature[0]], METRES[faces.unit], faces.unit
    groups = [name for name in names_of(face)[1:] if not is_query(name) and "+" not in name]
    centre = _comma(feature_centre(faces, feature)[0] / scale, faces.size / scale)
    if face.point is None:
        return groups
    at = _comma(face.point / scale, faces.size / scale)
    if face.kind == "plane" and face.axis is not None:
        axis = int(np.argmax(np.abs(face.axis)))
        place = _comma([face.point[axis] / scale], faces.size / scale)
        return [*groups, f"plane {'xyz'[axis]}={place}{unit}", f"plane near {centre}{unit}"]
    if face.kind in ("cylinder", "sphere") and face.radius is not None:
        sized = f"{face.kind} r={face.radius / scale:.6g}{unit}"
        return [*groups, sized, f"{sized} at {at}{unit}", f"{sized} near {centre}{unit}"]
    return [*groups, f"{face.kind} at {at}{unit}", f"{face.kind} near {centre}{unit}"]


def _comma(values: Array | Sequence[float], size: float) -> str:
    return ",".join(f"{value:.6g}" for value in tidy(values, size))
