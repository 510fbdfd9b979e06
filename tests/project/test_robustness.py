"""Files of every format, changed by chance: each is read or refused in a line, within seconds and with little memory."""

from __future__ import annotations

import mutated_inputs
import numpy as np
import pytest

from ffr_prep.common.errors import InputError
from ffr_prep.common.reading import read_text, read_toml, reading

NAMES = tuple(mutated_inputs.formats())


@pytest.fixture(scope="module")
def samples(tmp_path_factory):
    folder = tmp_path_factory.mktemp("fuzz") / "samples"
    folder.mkdir()
    mutated_inputs.make_samples(folder)
    return folder


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_mutated_inputs_are_read_or_refused(samples, name):
    counted = mutated_inputs.count(name, samples, 2000 // mutated_inputs.SLOW.get(name, 1), seed=7)
    assert counted.wrong == []
    assert counted.slowest < mutated_inputs.PATIENCE


@pytest.mark.parametrize("name", NAMES)
def test_sound_samples_are_read(samples, name):
    files, read = mutated_inputs.formats()[name]
    for file in files:
        read(samples / file)


def test_mutations_repeat_and_change():
    data, other = b"1.5, 2\nabc\n" * 9, b"xyz" * 20
    made = [mutated_inputs.mutated(data, other, np.random.default_rng(k)) for k in range(50)]
    assert made == [mutated_inputs.mutated(data, other, np.random.default_rng(k)) for k in range(50)]
    assert sum(one != data for one in made) > 40


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a = " + "1" * 5000, "too large for a scene file"),
        ("a = " + "[" * 3000 + "]" * 3000, "nested"),
        ("a = " + "[" * 100 + "]" * 100, "nested"),
        (".".join("a" * 300) + " = 1", "nested"),
        ("[a]\nb = [9223372036854775808]", "a.b is an integer beyond 64 bits"),
        ("a = '\xff'", "not text in UTF-8; save it so"),
    ],
)
def test_toml_that_no_scene_can_be_is_refused(tmp_path, text, words):
    (tmp_path / "a.toml").write_text(text, encoding="latin-1")
    with pytest.raises(InputError, match=words):
        read_toml(tmp_path / "a.toml", "a scene file")


@pytest.mark.parametrize("code", ["utf-8", "utf-8-sig", "utf-16"])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_texts_are_read_however_they_were_saved(tmp_path, code, end):
    path = tmp_path / "a.toml"
    path.write_bytes(f"name = 'm\u00fcll'{end}[b]{end}c = 1{end}".encode(code))
    assert read_toml(path, "a scene file") == {"name": "m\u00fcll", "b": {"c": 1}}
    assert read_text(path, "a text").splitlines() == ["name = 'm\u00fcll'", "[b]", "c = 1"]


def test_half_a_letter_of_utf_16_is_refused(tmp_path):
    path = tmp_path / "a.inp"
    path.write_bytes("ab".encode("utf-16")[:-1])
    with pytest.raises(InputError, match="write it in UTF-8"):
        read_text(path, "a text")


def test_errors_that_nobody_has_thought_of_ask_for_a_report(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("")
    words = r"a\.txt cannot be read as a poem \(ZeroDivisionError.*please report"
    with pytest.raises(InputError, match=words), reading(path, "a poem"):
        print(1 / 0)
