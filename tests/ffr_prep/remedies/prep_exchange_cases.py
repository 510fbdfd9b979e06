"""What is said of SID files and of MBDyn's, and of bodies that they cannot hold; files are mended as they were written."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import partial
from pathlib import Path

from prep_remedy import samples, with_files
from said import Case
from synthetic import cloud

import ffr_prep as fp
from ffr_prep.interchange.bare_inertia import held
from ffr_prep.interchange.formats import export_body, import_body

p = partial


def changed(name: str, pattern: str, new: str, after: str = "") -> Case:
    """A sample in which the first match behind a text is replaced."""

    def wrong() -> str:
        text = (samples() / name).read_text()
        at = text.index(after)
        found = text[:at] + re.sub(pattern, new, text[at:], count=1, flags=re.MULTILINE)
        assert found != text, pattern
        return found

    return Case(
        lambda: with_files(lambda: import_body(Path(name)), {name: (("", wrong()),)}),
        lambda: with_files(lambda: import_body(Path(name)), {}),
    )


def sid(pattern: str, new: str, after: str = "") -> Case:
    return changed("body.sid", pattern, new, after)


def fem(pattern: str, new: str, after: str = "", name: str = "full.fem") -> Case:
    return changed(name, pattern, new, after)


def until(record: int) -> str:
    """From this record group to the next one."""
    return rf"\*\* RECORD GROUP {record},[^*]*(\*\*\n)?"


SID = [
    sid(r"^ *3", "    x"),
    sid(r"^ *3 +3 ", "    3    4 "),
    sid(r"(?s)end frame.*", ""),
    sid(r"(nelastq.*)", r"\1\n      nelastq = 3"),
    sid(r"( +nelastq)", r"two words\n\1"),
    sid(r"end phi", "end psi"),
    sid(r"(?s) +mdCM.*?end mdCM *\n", ""),
    sid(r"(?s)( +mdCM.*?end mdCM *\n)", r"\1    other \n    end other \n"),
    sid(r".*nrow.*\n", ""),
    sid(r"( +nrow.*\n)", r"\1      rank = 3\n", "mdCM"),
    sid(r"m0\( +2, ", "m0(   1, ", "mdCM"),
    sid(r"(nrow +=) 3", r"\1 4", "mdCM"),
    sid(r"(order +=) 1", r"\1 2", "mdCM"),
    sid(r"(nq +=) 3", r"\1 5", "mdCM"),
    sid(r"(structure +=) 3", r"\1 7", "mdCM"),
    sid(r"(structure +=) 3", r"\1 2", "mdCM"),
    sid(r"(order +=) 1", r"\1 0", "mdCM"),
    sid(r"(structure +=) 3", r"\1 0", "mdCM"),
    sid(r"(structure +=) 3(\n +m0)", r"\1 1\n      m0(   1,   2) = 1.0\2", " Me "),
    sid(r"(structure +=) 3(\n +m0)", r"\1 2\n      m0(   1,   2) = 1.0\n      m0(   2,   1) = 2.0\2", " Me "),
    sid(r"m0\( +3, ", "m0(   9, ", "mdCM"),
    sid(r"(nelastq +=) 3", r"\1 4"),
    sid(r"mass .*", "mass = x"),
    sid(r"mass .*", "mass = 1e999"),
    sid(r"(nrow +=) 3", r"\1 3.5", "mdCM"),
    sid(r"mass .*", "mass = -1.0"),
    sid(r"body ref", "node 3"),
    sid(r"(?s)      new node = 3.*?end node *\n", ""),
    sid(r"(m1\( +1, +1, +1\) +=) .*", r"\1 9.0", "origin"),
    sid(r"(m0\( +1, +2\) +=) .*", r"\1 9.0", " Gr "),
    sid(r"(m1\( +1, +2, +1\) +=) .*", r"\1 99.0", " Oe "),
    sid(r"(m1\( +1, +1, +1\) +=) .*", r"\1 99.0", " Oe "),
    sid(r"(m0\( +1, +1\) +=) .*", r"\1 -1.0", " Me "),
    sid(r"(m0\( +1, +1\) +=) .*", r"\1 -1.0", " Ke "),
    sid(r"(structure +=) 3\n( +m0)", r"\1 3\n      m0(   1,   2) = 0.5\n\2", " Ke "),
]
FEM = [
    fem(r"GROUP 1,", "GROUP 2,"),
    fem(r"GROUP 5,", "GROUP 50,"),
    fem(r"GROUP 6,", "GROUP 5,"),
    fem(r"(?s)\*\* RECORD GROUP 10,.*", ""),
    fem(r"REV0", "HELLO"),
    fem(r"REV0 3 3", "REV0 3 -3"),
    fem(r"REV0 3", "REV0 0"),
    fem(r"REV0 3 3", "REV0 4 3"),
    fem(r"(\*\* +MODE SHAPE # 1\n.*\n)", r"\1** early\n"),
    fem(r"(GROUP 9,.*\n.*)", r"\1 1.0"),
    fem(r"(GROUP 12,.*\n(?:\s+\S+){5}\s+)\S+", r"\g<1>9.0"),
    fem(until(12), "", name="full.fem"),
    fem(r"(GROUP 11,.*\n.*\n\s+)\S+", r"\g<1>9.0", name="legacy.fem"),
    fem(until(18), "**\n"),
    fem(r"(GROUP 18,.*\n\s+)\S+", r"\g<1>99.0"),
    fem(r"(GROUP 16,.*\n\s+)\S+", r"\1x"),
    *(fem(r"(GROUP 10,)", rf"GROUP 19, LOADS\n{text}** RECORD \1") for text in ("", "2\n1\n", f"1\n99\n{'1. ' * 9}\n")),
]

# ---- bodies ----------------------------------------------------------------------------------------------------------

BODY = cloud(3, points=4, stiffness=50.0)


def exported(body: fp.FlexibleBody = BODY, name: str = "new.SID_FEM", surface: bool = False, **how: object) -> object:
    return with_files(lambda: export_body(body, Path(name), surface, how), {})


def read(units: str) -> object:
    return with_files(lambda: import_body(Path("body.sid"), units=units), {})


BODIES = [
    Case(p(exported, replace(BODY, surface=None), surface=True), exported),
    Case(p(exported, replace(BODY, interfaces=(), surface=None)), exported),
    Case(p(exported, name="new.fem", kind="half"), p(exported, name="new.fem", kind="full")),
    Case(p(exported, name="new.fem", kind="legacy", surface=False), p(exported, name="new.fem", kind="full")),
    Case(p(exported, layout="both"), p(exported, layout="mode-major")),
    Case(p(read, "yards"), p(read, "m-kg-s")),
    Case(p(held, BODY), exported),
]
CASES = SID + FEM + BODIES
