"""Which faces a region means (`ffr_prep.mesh.geometry.region_words` says what may be written)."""

from __future__ import annotations

import fnmatch
import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.common.registry import choice
from ffr_prep.mesh.geometry.face import METRES, Face
from ffr_prep.mesh.geometry.faces import Faces, feature_centre, feature_in_words, several_solids, solids_of, tidy
from ffr_prep.mesh.geometry.misfits import across, fitting, kind_of, misfits, nearest, off_surface
from ffr_prep.mesh.geometry.region_words import Names, Query, is_query, parsed

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
    shown = _offers(faces, meant)
    if query.near is not None:
        raise InputError(f"{query.text!r}: these are equally near; write one, or several joined by +: {shown}")
    raise InputError(
        f"{query.text!r} finds {len(meant)} {query.kind}s; write 'all {query.text}' for all of them, or one: {shown}"
    )


def _meant(faces: Faces, query: Query) -> list[list[int]]:
    """The faces of each surface that fits, or of the features that are equally near; one where the query is clear."""
    fits = fitting(faces, query)
    if not fits.size:
        return []
    if query.near is not None:
        return _nearest(faces, query, fits)
    surfaces = np.zeros(fits.size, int) if query.every else faces.table.surface[fits]
    return [fits[surfaces == one].tolist() for one in dict.fromkeys(surfaces.tolist())]


def _nearest(faces: Faces, query: Query, fits: Array) -> list[list[int]]:
    """Of the features of fitting faces those that are nearest to the point of the query."""
    distances = nearest(faces, fits, np.array(query.near))
    least = float(distances.min())
    if least > faces.size:
        scale = METRES[faces.unit]
        raise InputError(
            f"{query.text!r}: the point is {least / scale:.4g} {faces.unit} away from the body, whose size is "
            f"{faces.size / scale:.4g} {faces.unit}; numbers without a unit are {faces.unit}{_thousand(faces, query)}"
        )
    tied = set(fits[distances <= least + faces.tolerance * faces.size].tolist())
    known = set(fits.tolist())
    return [[k for k in of if k in known] for of in faces.features if tied & set(of)]


# ---- what is near, and what to type ---------------------------------------------------------------------------------


def _what_is_near(faces: Faces, query: Query) -> str:
    """The features that come closest, each with what to type."""
    outer = [f for f in faces.features if not faces.faces[f[0]].inner]
    of_kind = [f for f in outer if kind_of(query) in ("face", faces.faces[f[0]].kind)]
    if not of_kind:
        kinds = dict.fromkeys(face.kind for face in faces.faces)
        return f"There is no {query.kind} at all; there are: {', '.join(kinds)}. `ffr-prep faces FILE` lists them"
    first = np.array([f[0] for f in of_kind])
    loose = replace(query, through=None, at=None, near=None)
    rough = np.minimum(misfits(faces, query), misfits(faces, loose))[first]
    order = np.lexsort((_apart(faces, query)[first], rough))
    return f"Near are{_thousand(faces, query)}: {_offers(faces, [of_kind[k] for k in order])}"


def _apart(faces: Faces, query: Query) -> Array:
    """(F,) [m] how far faces are from the place of a query."""
    point = query.at or query.near
    if point is not None:
        return off_surface(faces, point)
    return np.zeros(len(faces)) if query.through is None else across(faces, *query.through)


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
        fits = fitting(faces, scaled)
        if fits.size and (scaled.near is None or nearest(faces, fits, np.array(scaled.near)).min() < faces.size):
            meant = f", so write {unit} behind the numbers" if faces.unit != unit else ""
            return f" (a factor of a thousand would make it fit{meant})"
    return ""


def _offers(faces: Faces, features: Sequence[Sequence[int]]) -> str:
    """The query to type for the first of several features; their description where no query tells them apart."""
    typed = [query_for(faces, feature) for feature in features[:_SHOWN]]
    known = [
        text if is_query(text) else f"{text} ({feature_in_words(faces, feature)})"
        for text, feature in zip(typed, features, strict=False)
    ]
    more = [f"and {len(features) - _SHOWN} more"] if len(features) > _SHOWN else []
    return "; ".join([*known, *more])


def query_for(faces: Faces, feature: Sequence[int]) -> str:
    """A query that finds the faces of a feature and no others, or else their names."""
    wanted = set(feature)
    for text in _with_solid(faces, feature, _candidates(faces, feature)):
        (term,) = parsed(text, faces.unit)
        hits = _meant(faces, term) if isinstance(term, Query) else [_by_name(faces, text)]
        if len(hits) == 1 and set(hits[0]) == wanted:
            return text
    return "+".join(faces.faces[k].name for k in feature)


def _with_solid(faces: Faces, feature: Sequence[int], queries: Sequence[str]) -> list[str]:
    """Queries, and behind them the same with the solid of a feature, where there are several and this has one."""
    solids = solids_of(faces, feature)
    if len(solids) != 1 or not several_solids(faces) or set("'+:@") & set(solids[0]):
        return list(queries)
    named = f"solid={solids[0]}" if re.fullmatch(r"[^\s,'*?\[]+", solids[0]) else f"solid='{solids[0]}'"
    return [*queries, *(f"{text} {named}" for text in queries if is_query(text))]


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
