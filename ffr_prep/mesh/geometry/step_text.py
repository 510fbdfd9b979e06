"""Facts in the text of a STEP file that the CAD library does not pass on: its unit of length, and names of faces.

Source: ISO 10303-21 (clear text encoding), ISO 10303-42 (geometric and topological representation).
"""

from __future__ import annotations

import re
from collections.abc import Sequence

_PREFIXES = {"$": "m", ".CENTI.": "cm", ".MILLI.": "mm"}
_SURFACES = {  # words of STEP and of the CAD library
    "PLANE": "plane",
    "CYLINDRICAL_SURFACE": "cylinder",
    "CONICAL_SURFACE": "cone",
    "SPHERICAL_SURFACE": "sphere",
    "TOROIDAL_SURFACE": "torus",
}
_ENTITY = re.compile(r"#(\d+)\s*=\s*([A-Z_]+)\s*\(((?:'[^']*+'|[^';])*+);")  # a quote in a text is two quotes
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


def face_labels(text: str, kinds: Sequence[str]) -> list[str]:
    """The name of each face of the CAD library, whose kinds are given, or "".

    The library numbers faces solid by solid in the order of their shells. Where the file's kinds in that order are not those
    of the library (instances of a part, healed faces), no name is told rather than a wrong one.
    """
    entities = {number: (word, body) for number, word, body in _ENTITY.findall(text)}
    shells = [body for word, body in entities.values() if word in ("CLOSED_SHELL", "OPEN_SHELL")]
    found = []
    for face in [number for body in shells for number in re.findall(r"#(\d+)", body)]:
        word, body = entities.get(face, ("", ""))
        parts = _FACE.fullmatch(body) if word in ("ADVANCED_FACE", "FACE_SURFACE") else None
        surface = entities.get(parts[2], ("", ""))[0] if parts else ""
        found.append((_spelled(parts[1]) if parts else "", _SURFACES.get(surface, "")))
    named = {name for name, _ in found if not _MADE_UP.fullmatch(name)}
    same = len(found) == len(kinds) and all(of in ("", kind) for (_, of), kind in zip(found, kinds, strict=True))
    return [name if name in named else "" for name, _ in found] if same and named else [""] * len(kinds)


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
