"""Every quantity of a scene file refuses a unit of another dimension, by its key and with the units that do.

The examples of the reference are whole tables of a file, one or more for each entry of the schema, which together have all of
its keys. Each number in them is given in a unit that fits nothing, one after the other.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator
from typing import Any

import pytest
from pydantic import ValidationError
from test_site_reference import KINDS, snippets, whole

from ffr_dyn.scene_file.read import load_scene
from ffr_dyn.scene_file.schema import scene_entry
from ffr_prep.common.errors import InputError

WRONG = ("3 kg^5/s^7", "2 * 3 kg^5/s^7 + 1")
REFUSALS = ("does not fit", "comes to kg^5/s^7, and is given in", "without a unit", "valid integer", "valid number")
# Any unit may be right: what parameters and inputs are used for says more; and numbers that count are no quantities.
ANY = {"parameters", "inputs"}
COUNTS = {"modes", "turns", "triangles", "points", "steps", "nodes"}


def numbers(value: Any, at: tuple = ()) -> Iterator[tuple]:
    """Paths to the numbers, and to the texts that are numbers with a unit or formulas, of nested tables and lists."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from numbers(inner, (*at, key))
    elif isinstance(value, list):
        for k, inner in enumerate(value):
            yield from numbers(inner, (*at, k))
    elif isinstance(value, (int, float)) and not isinstance(value, bool):
        yield at


def replaced(tree: dict, at: tuple, value: Any) -> dict:
    found = copy.deepcopy(tree)
    inner = found
    for key in at[:-1]:
        inner = inner[key]
    inner[at[-1]] = value
    return found


def complaints(tree: dict) -> set[tuple]:
    """Where, and what."""
    try:
        scene_entry().model_validate(tree, context={"parameters": {"length": 0.3}})
    except ValidationError as error:
        return {(tuple(map(str, item["loc"])), item["msg"]) for item in error.errors()}
    except InputError as error:
        return {((), str(error))}
    return set()


@pytest.mark.parametrize("name", KINDS["scene"].examples)
def test_a_wrong_unit_is_refused_by_name(name, tmp_path, monkeypatch):
    (tmp_path / "angle.csv").write_text("0, 0\n1, 0.1\n2, 0\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    silent = []
    for part in snippets("scene", name):
        tree = whole(name, part)
        for at in numbers(tree):
            if set(at) & ANY or set(at) & COUNTS:
                continue
            for wrong in WRONG:
                said = complaints(replaced(tree, at, wrong))
                if not any(words in text for _, text in said for words in REFUSALS):
                    silent.append((at, wrong, said))
    assert silent == []


HINGE = {"joint": "hinge"}
FORCES = {
    "joint-spring": {"stiffness": 20.0, "damping": 0.1, "free": 0.2, "preload": 1.0},
    "joint-friction": {"coulomb": 0.3, "creep": 1e-3, "static": 0.4, "stribeck": 0.1, "viscous": 0.2},
    "joint-stop": {"stiffness": 1e4, "entry": 0.01, "lower": -1.0, "upper": 1.0, "damping": 2.0},
    "actuator": {"force": 2.0, "stiffness": 1.0, "damping": 1.0},
    "servo": {"target": 0.5, "kp": 400.0, "kd": 20.0, "limit": 50.0},
}
UNITS = {
    "stroke": {"stiffness": "N/mm", "kp": "N/mm", "damping": "N s/m", "viscous": "N s/m", "kd": "N s/m", "creep": "mm/s",
               "stribeck": "m/s", "free": "mm", "entry": "mm", "lower": "mm", "upper": "mm", "target": "mm"},
    "angle": {"stiffness": "N m/rad", "kp": "N m/deg", "damping": "N m s/rad", "viscous": "N m s", "kd": "N m s/rad",
              "creep": "rpm", "stribeck": "rad/s", "free": "deg", "entry": "deg", "lower": "deg", "upper": "deg",
              "target": "deg"},
}  # fmt: skip


@pytest.mark.parametrize("kind", FORCES)
def test_the_unit_of_a_force_on_a_joint_is_that_of_its_coordinate(kind):
    """In whatever order the keys stand."""
    for coordinate, other in (("angle", "stroke"), ("stroke", "angle")):
        for key in FORCES[kind]:
            fits, wrong = (UNITS[c].get(key, {"angle": "N m", "stroke": "N"}[c]) for c in (coordinate, other))
            for first in (True, False):
                order = {"coordinate": coordinate}
                entry = {"kind": kind, **HINGE, **FORCES[kind]}
                entry = {**order, **entry} if first else {**entry, **order}
                where = {"bodies": {}, "analysis": {"kind": "assemble"}, "forces": {"f": entry}}
                before = complaints(where)
                assert complaints(replaced(where, ("forces", "f", key), f"3 {fits}")) == before
                said = complaints(replaced(where, ("forces", "f", key), f"3 {wrong}")) - before
                assert any("does not fit: this is given in" in text for _, text in said), (coordinate, key, wrong)


@pytest.mark.parametrize("given", ["${k}", "k", " k "])
def test_a_parameter_keeps_its_unit_where_it_stands_alone(given, tmp_path):
    """In a formula it is a number in SI units, as every other."""
    path = tmp_path / "scene.toml"
    path.write_text(
        f"""
        [parameters]
        k = "3 kg"
        [bodies]
        [springs]
        spring = {{i = "ground.a", j = "ground.b", stiffness = "{given}"}}
        [loads]
        load = {{marker = "ground.a", force = ["{given}", 0, 0]}}
        [analysis]
        kind = "assemble"
        """,
        encoding="utf-8",
    )
    with pytest.raises(InputError) as said:
        load_scene(path)
    assert "the unit 'kg' does not fit: this is given in N/m" in str(said.value)
    assert "the unit 'kg' does not fit: this is given in N " in f"{said.value} "


def test_the_unit_of_a_driver_a_coupling_and_an_event_is_that_of_what_they_name():
    def refused(table: str, entry: dict, key: str, text: Any) -> bool:
        tree = {"bodies": {}, "analysis": {"kind": "forward", "end": 1.0, "output_step": 0.1}}
        if table == "events":
            tree["analysis"]["events"] = {"e": entry}
            return complaints(replaced(tree, ("analysis", "events", "e", key), text)) != complaints(tree)
        return complaints({**tree, table: {"e": {**entry, key: text}}}) != complaints({**tree, table: {"e": entry}})

    driver = {"joint": "hinge", "function": 1.0}
    assert refused("drivers", driver, "function", "3 mm")
    assert not refused("drivers", driver, "function", "3 deg")
    assert refused(
        "drivers", {**driver, "coordinate": "stroke"}, "function", {"harmonic": {"amplitude": "3 deg", "frequency": 1}}
    )
    assert refused("drivers", driver, "function", {"polynomial": [0, "3 rad"]})
    assert not refused("drivers", driver, "function", {"polynomial": [0, "3 rpm"]})
    assert refused("drivers", driver, "function", {"table": [[0, 1, 2, 3], ["1 mm", 1, 2, 3]]})
    rack = {"first": "pinion.angle", "second": "rack.stroke", "ratio": 0.02}
    assert not refused("couplings", rack, "ratio", "20 mm")
    assert refused("couplings", rack, "ratio", "3 rad")
    assert refused("couplings", rack, "offset", "3 rad")
    event = {"quantity": "rod.tip.position.y", "value": 0.1}
    assert refused("events", event, "value", "3 kg")
    assert not refused("events", event, "value", "3 mm")
    spring = {"i": "ground.a", "j": "rod.b", "stiffness": {"at": [0, 1], "values": ["1 N", "3 N"]}}
    assert not refused("springs", spring, "damping", "3 N s/m")
    assert refused("springs", spring, "stiffness", {"at": [0, 1], "values": ["1 m", "3 N"]})
    bushing = {"kind": "bushing", "i": "ground.a", "j": "rod.b", "stiffness": [1, 1, 1, 1, 1, 1]}
    assert not refused("forces", bushing, "stiffness", ["1 N/mm", 1, 1, "3 N m/rad", 1, 1])
    assert refused("forces", bushing, "stiffness", ["1 N m/rad", 1, 1, 1, 1, 1])


@pytest.mark.parametrize(
    ("coordinate", "normal", "fits", "else_where"),
    [
        ("stroke", {}, "5 N", "5 N m"),
        ("stroke", {"normal": 100.0}, "0.3", "5 N"),
        ("stroke", {"normal": "100 N"}, "0.3", "5 N"),
        ("stroke", {"normal": {"formula": "100 + t"}}, "0.3", "5 N"),
        ("angle", {}, "5 N m", "3 mm"),
        ("angle", {"normal": "100 N"}, "3 mm", "5 N m"),
    ],
)
def test_dry_friction_beside_a_normal_force_is_a_coefficient(coordinate, normal, fits, else_where):
    friction = {"kind": "joint-friction", "joint": "j", "creep": 1e-3, "coulomb": 0.1, "stribeck": 0.1, "static": 9.0}

    def said(key: str, value: str) -> set[Any]:
        entry = {**friction, "coordinate": coordinate, key: value, **normal}
        return complaints({"bodies": {}, "analysis": {"kind": "assemble"}, "forces": {"f": entry}})

    for key in ("coulomb", "static"):
        assert said(key, fits) == said(key, "0.3")
        assert any("does not fit: this is given in" in text for _, text in said(key, else_where))
