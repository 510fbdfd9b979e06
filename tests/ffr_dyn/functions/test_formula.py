"""Formulas: what they mean, that their derivatives are exact, and that they can do nothing else."""

from __future__ import annotations

import math
from contextlib import nullcontext

import numpy as np
import pytest

from ffr_dyn.functions import operations
from ffr_dyn.functions.formula import TIME, Measured, formula, names_in, number, parse, text_of, value_of
from ffr_dyn.functions.quantities import with_unit
from ffr_dyn.functions.time_functions import evaluate, operation, table
from ffr_prep.common.errors import InputError

FORMULAS = {
    "3": lambda t: 3.0,
    "t": lambda t: t,
    "-t ** 2 + 4 * t / 2 - 1e-1": lambda t: -(t**2) + 2 * t - 0.1,
    "a * sin(2 * pi * crank.f * t)": lambda t: 0.7 * np.sin(2 * np.pi * 1.3 * t),
    "cos(t) / (1 + t ** 2)": lambda t: np.cos(t) / (1 + t**2),
    "exp(-t) * log(2 + t)": lambda t: np.exp(-t) * np.log(2 + t),
    "sqrt(1 + t) + tanh(t) + atan(2 * t)": lambda t: np.sqrt(1 + t) + np.tanh(t) + np.arctan(2 * t),
    "asin(t / 3) - acos(t / 4)": lambda t: np.arcsin(t / 3) - np.arccos(t / 4),
    "smooth(t - 0.2) + step(t - 0.1) * abs(t) + sign(t)": lambda t: (
        10 * (t - 0.2) ** 3 - 15 * (t - 0.2) ** 4 + 6 * (t - 0.2) ** 5 + t + 1
    ),
    "ramp(t - 0.2)": lambda t: 2.5 * (t - 0.2) ** 4 - 3 * (t - 0.2) ** 5 + (t - 0.2) ** 6,
    "(1 + t) ** t": lambda t: (1 + t) ** t,
    "min(t, 0.5) + max(t, 0.5 * t)": lambda t: min(t, 0.5) + t,
    "(2 + t) ** -1.5 + t ** 3 + t ** 1 + t ** 0": lambda t: (2 + t) ** -1.5 + t**3 + t + 1,
}
PARAMETERS = {"a": 0.7, "crank.f": 1.3}


@pytest.mark.parametrize("text", FORMULAS)
def test_value_and_derivatives_of_a_formula(text):
    """Derivatives against the contour integral of an analytic function, by central differences of order six here."""
    function, exact = formula(text, PARAMETERS), FORMULAS[text]
    for t in (0.31, 0.77):
        value, rate, second = evaluate(function, t)
        h = 2e-3
        f = [exact(t + k * h) for k in range(-3, 4)]
        assert value == pytest.approx(f[3], rel=1e-13, abs=1e-13)
        assert rate == pytest.approx(np.dot([-1, 9, -45, 0, 45, -9, 1], f) / 60 / h, rel=1e-9, abs=1e-9)
        assert second == pytest.approx(np.dot([2, -27, 270, -490, 270, -27, 2], f) / 180 / h**2, rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("text", FORMULAS)
def test_kernels_evaluate_formulas_as_the_readable_form(text):
    from ffr_dyn.compile.scene_tables import FunctionTable
    from ffr_dyn.kernels.functions import evaluate_functions

    numbers = FunctionTable()
    at = numbers.add(formula(text, PARAMETERS))
    tables = numbers.tables()
    out = np.zeros((tables.kind.size, 3))
    for t in (0.31, 0.77):
        evaluate_functions(tables, np.zeros(0), t, out)
        np.testing.assert_allclose(out[at], evaluate(formula(text, PARAMETERS), t), rtol=1e-13, atol=1e-13)


def test_kernels_and_readable_form_number_the_operations_alike():
    from ffr_dyn.kernels import operations as compiled

    names = [name for name in vars(compiled) if name.isupper()]
    assert len(names) == 20
    assert all(getattr(compiled, name) == getattr(operations, name) for name in names)


@pytest.mark.parametrize("text", FORMULAS)
def test_a_formula_survives_its_text(text):
    function = formula(text, PARAMETERS)
    assert formula(text_of(function)) == function


def test_smooth_rises_with_two_continuous_derivatives_and_stays():
    function = formula("smooth(t)")
    for t, value in ((-1.0, 0.0), (0.0, 0.0), (1.0, 1.0), (2.0, 1.0)):
        assert evaluate(function, t) == (value, 0.0, 0.0)


def test_a_ramp_reaches_its_speed_and_goes_no_faster():
    function = formula("3 * 0.5 * ramp(t / 0.5)")
    assert max(evaluate(function, t)[1] for t in np.linspace(-0.1, 1.0, 111)) <= 3.0 + 1e-12
    assert evaluate(function, -0.1) == (0.0, 0.0, 0.0)
    assert evaluate(function, 1.0) == pytest.approx((3 * (1.0 - 0.25), 3.0, 0.0))


def test_time_times_a_smooth_step_overshoots_its_speed_as_the_page_says():
    product = formula("t * smooth(t / 0.5)")
    rates = [evaluate(product, t)[1] for t in np.linspace(0, 0.5, 301)]
    assert max(rates) == pytest.approx(16 / 9, rel=1e-9)


def test_powers_have_derivatives_at_zero():
    assert evaluate(formula("t ** 2"), 0.0) == (0.0, 0.0, 2.0)
    assert evaluate(formula("t ** 1"), 0.0) == (0.0, 1.0, 0.0)
    assert evaluate(formula("t ** 0"), 0.0) == (1.0, 0.0, 0.0)


def test_constants_are_folded():
    assert number("2 * (a + 1) ** 2", {"a": 2.0}) == 18.0
    assert formula("1 + 1").data == (2.0,)


def test_measured_quantities_are_named_and_filled_in():
    expression = parse("-k * rod.tip.position.x + rod.q[2] * t", {"k": 3.0}, "load")
    assert list(names_in(expression)) == ["rod.tip.position.x", "rod.q.2"]
    assert value_of(expression, 2.0, {"rod.tip.position.x": 0.5, "rod.q.2": 10.0}) == 18.5
    assert math.isnan(value_of(parse("sqrt(a.b)", {}, "load"), 0.0, {"a.b": -1.0}))
    assert parse("a.b", {}, "load") == Measured("a.b")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("__import__('os')", ["'__import__'", "not a known function"]),
        ("().__class__", ["is not a name"]),
        ("t if t else 1", ["is not allowed"]),
        ("[t for t in t]", ["is not allowed"]),
        ("lambda: 1", ["is not allowed"]),
        ("'a' * 3", ["'a'", "is not allowed"]),
        ("True", ["is not allowed"]),
        ("1j", ["unknown unit 'j'"]),
        ("t.real.imag(3)", ["not a known function"]),
        ("sin(t, t)", ["1 argument"]),
        ("min(t)", ["2 arguments"]),
        ("sin(x=t)", ["1 argument"]),
        ("sin(*t)", ["1 argument"]),
        ("t +", ["is not a formula"]),
        ("", ["is not a formula"]),
        ("t\0", ["is not a formula"]),
        ("sine(t)", ["did you mean 'sin'"]),
        ("2 * lenght", ["'lenght'", "did you mean 'length'"]),
        ("1 / 0", ["'1 / 0'", "has no value"]),
        ("(-1) ** 0.5", ["has no value"]),
        ("log(-1)", ["has no value"]),
        ("9 ** 9 ** 9", ["has no value"]),
        ("1e999", ["too large"]),
        ("9" * 400, ["too large"]),
        ("rod.tip.position.x", ["depends on 'rod.tip.position.x'"]),
        ("(" * 90 + "t" + ")" * 90 + "+ t" * 200, ["nested more than 100 deep"]),
        ("-" * 5000 + "t", ["formula"]),
        ("t := 3", ["is not a formula"]),
    ],
)
def test_a_formula_can_do_nothing_else(text, words):
    with pytest.raises(InputError) as caught:
        formula(text, {"length": 1.0}, "driver 'motor'")
    for word in ["driver 'motor'", *words]:
        assert word in str(caught.value)


def test_a_number_must_not_depend_on_time():
    with pytest.raises(InputError, match="depends on t"):
        number("2 * t")


def test_a_table_in_a_formula_has_no_text():
    whole = operation(operations.MULTIPLY, TIME, table([0.0, 1.0, 2.0], [1.0, 2.0, 0.0]))
    assert evaluate(whole, 1.0)[0] == pytest.approx(2.0)
    with pytest.raises(InputError, match="table"):
        text_of(whole)


# ---- numbers with units -----------------------------------------------------------------------------------------------

GIVEN = {"mass": 2.0, "m": 3.0, **{name: with_unit(*of) for name, of in {
    "speed": (100, "rpm"), "f": (12, "Hz"), "length": (200, "mm")}.items()}}  # fmt: skip


@pytest.mark.parametrize(
    ("text", "unit", "at_one"),
    [
        ("2*pi/3 + 100 rpm*t", "rad", 2 * np.pi / 3 + 100 * np.pi / 30),
        ("30 deg + 2 rev/s * t", "rad", np.pi / 6 + 4 * np.pi),
        ("3 kg * 9.81 m/s^2", "N", 29.43),
        ("0.1 m * sin(2*pi*f*t + 90 deg)", "m", 0.1),
        ("0.1 m * 100 rpm", "m/s", np.pi / 3),
        ("3 N * smooth(t/2 s)", "N", 1.5),
        ("3 N / length + 5", "N/m", 20.0),
        ("3 N / m", "N", 1.0),
        ("-(5 kN m^2 - 2 N m^2)/2 m", "N m", -2499.0),
        ("max(3 N, 2e3 mN) + mass", "N", 5.0),
        ("sqrt(4 m^2)", "m", 2.0),
        ("speed*t", "rad", 100 * np.pi / 30),
        ("(3 mm)**2", "m^2", 9e-6),
    ],
)
def test_numbers_in_formulas_have_units(text, unit, at_one):
    assert evaluate(formula(text, GIVEN, unit=unit), 1.0)[0] == pytest.approx(at_one, rel=1e-14)


@pytest.mark.parametrize(
    ("text", "unit", "says"),
    [
        ("2*pi/3 + 100 rpm*t", "m", "comes to rad, and is given in m"),
        ("3 kg * t", "N", "comes to kg s, and is given in N"),
        ("3 kg * 9.81", "N or N m", "comes to kg, and is given in N or N m: give all its numbers their units, or none"),
        ("20 mm * t/2 s", "kg", "comes to m"),
        ("5 mm + 3 kg", None, "adds m and kg"),
        ("max(3 N, 2 kg)", None, "adds N and kg"),
        ("exp(3 m)", None, "exp is of a pure number or an angle, and is given m"),
        ("0.1 m * sin(3 Hz * t)", "m", "Hz counts turns"),
        ("2 Hz * t", "rad", "write 2 \\* pi before it"),
        ("1 + 3 N/m", "N", "comes to kg/s\\^2, and is given in N"),
        ("100 N/mmm * t", "N", "unknown unit 'mmm'"),
        ("2 newton * t", "N", "unknown unit 'newton'"),
        ("3 N*mm + 2 N", "N", "'mm' is not known; if it is a unit, write it behind its number"),
        ("3 m (2)", None, "calls '3 m'"),
    ],
)
def test_units_that_do_not_fit_are_refused(text, unit, says):
    with pytest.raises(InputError, match=says):
        formula(text, GIVEN, unit=unit)


@pytest.mark.parametrize(
    ("text", "unit", "says"),
    [
        ("-g", "m/s^2", ""),
        ("-heavy", "m/s^2", "comes to kg, and is given in m/s\\^2"),
        ("w * t", "rad", ""),
        ("heavy * t", "rad", "comes to kg s"),
        ("g - heavy", None, "adds m/s\\^2 and kg"),
        ("sin(often * t)", "m", "Hz counts turns"),
        ("3 * heavy", "N", ""),  # of any unit, the 3
        ("heavy * other", "N", ""),
    ],
)
def test_parameters_with_units_are_known_where_no_number_without_one_is_beside_them(text, unit, says):
    given = {"g": with_unit(9.81, "m/s^2"), "heavy": with_unit(9.81, "kg"), "w": with_unit(3.0, "rpm"), "other": 2.0}
    with pytest.raises(InputError, match=says) if says else nullcontext():
        formula(text, given | {"often": with_unit(5.0, "Hz")}, unit=unit)


def test_of_parameters_and_of_what_is_measured_nothing_is_known():
    formula("10 * length * smooth(t / 0.1 s)", GIVEN, unit="N")
    parse("-3 N s/m * slider.pin.velocity.x", GIVEN, "it", "N")
    parse("3 kg * slider.pin.velocity.x", GIVEN, "it", "N")
    with pytest.raises(InputError, match="adds N and kg"):
        parse("3 N + 2 kg - slider.pin.velocity.x", GIVEN, "it", "N")
