"""Facts in the text of a STEP file that the CAD library does not pass on: its unit of length, and names of faces.

Source: ISO 10303-21 (clear text encoding), ISO 10303-42 (geometric and topological representation).
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

_PREFIXES = {"$": "m", ".CENTI.": "cm", ".MILLI.": "mm"}
_SURFACES = {  # words of STEP and of the CAD library
    "PLANE": "plane",
    "CYLINDRICAL_SURFACE": "cylinder",
    "CONICAL_SURFACE": "cone",
    "SPHERICAL_SURFACE": "sphere",
    "TOROIDAL_SURFACE": "torus",
}
_ENTITY = re.compile(r"#(\d+)\s*=\s*([A-Z_]+)\s*\(((?:'[^']*+'|[^';])*+);")  # a quote in a text is two quotes
_TEXT = re.compile(r"'(?:[^']|'')*+'")
_FACE = re.compile(r"\s*'((?:[^']|'')*+)'[^']*,\s*#(\d+)\s*,\s*\.[TF]\.\s*\)\s*")
# Letters by their numbers in Unicode, by one in Latin-1, or by that of an ASCII letter 128 before; a backslash is two.
_CODE = re.compile(
    r"\\X(?P<bytes>[24])\\(?P<wide>(?:[0-9A-F]{4})*?)\\X0\\|\\X\\(?P<one>[0-9A-F]{2})|\\S\\(?P<upper>[ -~])|\\(?P<slash>\\)",
    re.IGNORECASE,
)
_MADE_UP = re.compile(r"(NONE|FACE|ADVANCED_FACE)?\s*\d*", re.IGNORECASE)


def length_unit(text: str) -> str:
    """The unit of the lengths: "m", "cm", "mm" or "in"; "mm" for any other, to which the CAD library converts."""
    context = re.search(r"GLOBAL_UNIT_ASSIGNED_CONTEXT\s*\(\s*\(([^)]*)\)", text)
    for reference in re.findall(r"#\d+", context[1]) if context else []:
        entity = re.search(rf"{reference}\s*=\s*\(([^;]*)\)\s*;", text)
        if entity and "LENGTH_UNIT" in entity[1]:
            if re.search(r"CONVERSION_BASED_UNIT\s*\(\s*'INCH", entity[1], re.IGNORECASE):
                return "in"
            prefix = re.search(r"SI_UNIT\s*\(\s*(\$|\.\w+\.)\s*,\s*\.METRE\.", entity[1])
            return _PREFIXES.get(prefix[1], "mm") if prefix else "mm"
    return "mm"


def face_labels(text: str, solids: Sequence[Sequence[str]]) -> list[str]:
    """The name of each face of the CAD library, or ""; solids: the kinds of the faces of each of its solids.

    The library numbers faces solid by solid in the order of their shells, and repeats those of a part for each instance.
    Where the file's kinds in that order are not those of the library (healed faces), or several parts that would fit have
    other names, no name is told rather than a wrong one.
    """
    entities = {number: (word, body) for number, word, body in _ENTITY.findall(text)}
    parts = [_labelled(entities, faces) for faces in _faces_of_solids(entities)]
    in_order = len(parts) == len(solids) and all(map(_fits, parts, solids))
    named = parts if in_order else [_only(parts, kinds) for kinds in solids]
    return [label for part in named for label, _ in part]


def _faces_of_solids(entities: Mapping[str, tuple[str, str]]) -> list[list[str]]:
    """The numbers of the faces of each solid, those of its voids included; of each shell that is in none."""
    shells = {n: body for n, (word, body) in entities.items() if word in ("CLOSED_SHELL", "OPEN_SHELL")}
    oriented = {n: body for n, (word, body) in entities.items() if word == "ORIENTED_CLOSED_SHELL"}
    solids = [body for word, body in entities.values() if word in ("MANIFOLD_SOLID_BREP", "BREP_WITH_VOIDS")]
    found, used = [], set()
    for body in solids:
        named = [m for n in _references(body) for m in (_references(oriented[n]) if n in oriented else [n])]
        used |= set(named)
        found.append([n for shell in named if shell in shells for n in _references(shells[shell])])
    return found + [_references(body) for n, body in shells.items() if n not in used]


def _references(body: str) -> list[str]:
    """The numbers of the entities that one refers to."""
    return re.findall(r"#(\d+)", _TEXT.sub("", body))


def _labelled(entities: Mapping[str, tuple[str, str]], faces: Sequence[str]) -> list[tuple[str, str]]:
    """The name and the kind of each face as the file has them, "" for what says nothing."""
    found = []
    for face in faces:
        word, body = entities.get(face, ("", ""))
        parts = _FACE.fullmatch(body) if word in ("ADVANCED_FACE", "FACE_SURFACE") else None
        name = _spelled(parts[1]) if parts else ""
        surface = entities.get(parts[2], ("", ""))[0] if parts else ""
        found.append(("" if _MADE_UP.fullmatch(name) else name, _SURFACES.get(surface, "")))
    return found


def _fits(part: Sequence[tuple[str, str]], kinds: Sequence[str]) -> bool:
    return len(part) == len(kinds) and all(of in ("", kind) for (_, of), kind in zip(part, kinds, strict=True))


def _only(parts: Sequence[Sequence[tuple[str, str]]], kinds: Sequence[str]) -> Sequence[tuple[str, str]]:
    """The part whose faces are of these kinds; one without names where none fits, or several of other names."""
    fitting = [part for part in parts if _fits(part, kinds)]
    if len({tuple(label for label, _ in part) for part in fitting}) == 1:
        return fitting[0]
    return [("", kind) for kind in kinds]


def _spelled(text: str) -> str:
    """A text of the file as it is read: letters beyond ASCII may stand in it as such or as codes (ISO 10303-21, 6.4.3)."""
    return _CODE.sub(_letters, text.replace("''", "'")).strip()


def _letters(code: re.Match[str]) -> str:
    if code["wide"] is not None:
        wide = "utf-16-be" if code["bytes"] == "2" else "utf-32-be"
        return bytes.fromhex(code["wide"]).decode(wide, "replace")
    if code["one"] is not None:
        return chr(int(code["one"], 16))
    return chr(ord(code["upper"]) + 128) if code["upper"] else code["slash"]
