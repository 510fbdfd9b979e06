"""Cards of mesh decks beside solids that would change a body: each is read, reported or refused.

A mesh becomes a body of solid elements alone. What else has stiffness, mass or damping, holds parts together or holds them
fast is told with the place where it belongs: the scene, a structure file, interfaces, the matrices of the whole.

Source: Abaqus Keywords Reference Guide; Ansys Mechanical APDL Element Reference; CalculiX CrunchiX user's manual, section
"Input deck format"; MSC Nastran Quick Reference Guide, section 5.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class _Kind:
    """Cards by patterns of their names; what they are, and where they belong."""

    names: str
    what: str
    remedy: str


_SPRINGS = ("springs and dashpots", "between interfaces they are [springs] and [forces] of a scene")
_MASSES = ("masses", "at an interface they are a rigid body of a scene on a fixed joint; otherwise change a density")
_BEAMS = (
    "beams, bars and rods",
    "only solids are reduced; a structure file joins them with solids (ffr-prep reduce-structure)",
)
_SHELLS = (
    "shells and membranes",
    "they serve as faces, without stiffness and mass; a structure file joins them with solids (ffr-prep reduce-structure)",
)
_RIGID = ("rigid and averaging connections", "make their nodes an interface, rigid or mean")
_JOINED = ("connections of parts", "let the parts share nodes, or join them as parts of a structure file")
_SUPPORTS = ("supports", "they are joints of a scene; --reference says how the body is held for its modes")
_LOADS = ("loads", "they belong to a scene")
_DAMPING = ("damping", "give it by --rayleigh, --loss-factor or --damping")
_TABLES = ("tables over temperature", "the constants are those of the card that they belong to")
_NOT_LINEAR = ("yield and creep", "bodies are linearly elastic")
_FLUID = ("acoustic elements", "a body is solid; what the fluid weighs is a mass of the scene, what it presses a load")
_REMOVED = (
    "elements that a step takes out or puts in",
    "a body has all its elements: delete those that it should not have",
)
_INITIAL = ("initial conditions", "a body begins without stress, and velocities belong to a scene")
_MATRICES = ("matrices", "take K and M of the whole model: ffr-prep reduce-matrices")

# Keywords with their star, types of elements without.
_ABAQUS = (
    _Kind(r"(SPRING|DASHPOT|CONN|JOINTC|GAP|ITT|ITS)[A-Z0-9]*", *_SPRINGS),
    _Kind(r"MASS|ROTARYI|HEATCAP|\*NONSTRUCTURAL MASS|\*MASS ADJUST", *_MASSES),
    _Kind(r"(B|PIPE|ELBOW|FRAME|T)\d[A-Z0-9]*", *_BEAMS),
    _Kind(r"AC3D\d+[A-Z]*", *_FLUID),
    _Kind(r"\*(SHELL|MEMBRANE|SHELL GENERAL) SECTION", *_SHELLS),
    _Kind(
        r"DCOUP3D|\*RIGID BODY|\*(KINEMATIC |DISTRIBUTING )?COUPLING|\*MPC|\*EQUATION|\*RIGID FACE|(R2D|R3D|RB2D|RB3D)\d",
        *_RIGID,
    ),
    _Kind(
        r"\*TIE|\*CONTACT( PAIR)?|\*CLEARANCE|\*EMBEDDED ELEMENT|\*SHELL TO SOLID COUPLING|\*FASTENER|\*PRE-TENSION SECTION"
        r"|\*CYCLIC SYMMETRY MODEL|\*MULTI-POINT CONSTRAINT",
        *_JOINED,
    ),
    _Kind(r"\*BOUNDARY|\*BOUNDARYF", *_SUPPORTS),
    _Kind(r"\*(CLOAD|DLOAD|DSLOAD|TEMPERATURE|BASE MOTION|CFLUX|DFLUX|CENTRIF)", *_LOADS),
    _Kind(r"\*MODEL CHANGE", *_REMOVED),
    _Kind(r"\*INITIAL CONDITIONS", *_INITIAL),
    _Kind(r"\*(DAMPING|GLOBAL DAMPING|MODAL DAMPING|DASHPOT DAMPING)", *_DAMPING),
    _Kind(r"U\d+|\*(USER ELEMENT|SUBSTRUCTURE PROPERTY|MATRIX ASSEMBLE|MATRIX INPUT)", *_MATRICES),
)
_NASTRAN = (
    _Kind(r"CELAS\d|CDAMP\d|CVISC|CBUSH(1D|2D)?|CGAP|CWELD|CFAST|CSEAM", *_SPRINGS),
    _Kind(r"CONM[12]|CMASS\d|NSM[1L]?|NSML1|NSMADD", *_MASSES),
    _Kind(r"CBAR|CBEAM3?|CROD|CONROD|CTUBE|CBEND", *_BEAMS),
    _Kind(r"PSHELL|PCOMPG?|PSHEAR|CSHEAR", *_SHELLS),
    _Kind(r"RBE[123]|RBAR1?|RROD|RTRPLT1?|RSPLINE|RJOINT|RSSCON|MPC", *_RIGID),
    _Kind(r"BCONP|BCTABLE|BCTABL1|BCTSET|BGSET|BCONECT|BCONPRG", *_JOINED),
    _Kind(r"SPC1?|SPCD", *_SUPPORTS),
    _Kind(r"FORCE[12]?|MOMENT[12]?|PLOAD[1245]?|GRAV|RFORCE|TEMPD?|SLOAD|ACCEL1?", *_LOADS),
    _Kind(r"GE", *_DAMPING),
    _Kind(r"PFLUID|FFLUID|CHACAB|CAABSF|CHACBR", *_FLUID),
    _Kind(r"MATT\d+", *_TABLES),
    _Kind(r"MATS1|MATEP|MATTEP|MATVP|CREEP|MATHE|MATVE", *_NOT_LINEAR),
    _Kind(r"GENEL|DMIG|DMIAX", *_MATRICES),
)


# Numbers of element types, and commands.
_ANSYS = (
    _Kind(r"14|37|38|39|40|214|250", *_SPRINGS),
    _Kind(r"21|71", *_MASSES),
    _Kind(r"3|4|8|10|1[168]|2[034]|44|54|59|16[01]|180|188|189|28[89]|290", *_BEAMS),
    _Kind(r"28|41|43|63|91|93|99|150|181|208|209|281", *_SHELLS),
    _Kind(r"184|CE|CERIG|CP", *_RIGID),
    _Kind(r"52|169|17\d", *_JOINED),
    _Kind(r"D|DSYM", *_SUPPORTS),
    _Kind(r"15[1-6]|F|SF|SFE|SFBEAM|BF|BFE|BFBLOCK|SFEBLOCK", *_LOADS),
    _Kind(r"29|30|220|221", *_FLUID),
    _Kind(r"27|50", *_MATRICES),
)


def left_out_of_ansys(found: Mapping[str, int]) -> tuple[str, ...]:
    """Notes on elements of an archive by the number of their type, and on commands, by how many of each there are."""
    return _told({f"of type {name}" if name.isdecimal() else name: count for name, count in found.items()}, _ANSYS)


def left_out_of_abaqus(found: Mapping[str, int]) -> tuple[str, ...]:
    """Notes on keywords ("*TIE") and types of elements ("B31") of a deck, by how many of each there are."""
    return _told(found, _ABAQUS)


def left_out_of_nastran(found: Mapping[str, int]) -> tuple[str, ...]:
    """Notes on cards of bulk data, by how many of each there are."""
    return _told(found, _NASTRAN)


def _told(found: Mapping[str, int], kinds: tuple[_Kind, ...]) -> tuple[str, ...]:
    notes = []
    for kind in kinds:
        here = [name for name in found if re.fullmatch(kind.names, name.removeprefix("of type "))]
        if here:
            notes.append(f"{', '.join(f'{found[name]} {name}' for name in here)} left out: {kind.what}; {kind.remedy}")
    return tuple(notes)
