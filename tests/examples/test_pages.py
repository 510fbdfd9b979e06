"""The tutorials and how-tos as they are written: what they have typed runs in order, and prints what they show.

In a page a block of `toml` whose first line is a file name (`# swing.toml`) is that file; `console` is commands (`$ ...`),
each with the lines of its output that the page shows; `python` is one program, and `text` after it what it prints. In a
shown line `...` stands for anything and numbers are compared to 2 %. `<!-- files of PAGE -->` takes the files of another
page; `<!-- needs PACKAGES -->` names what is not installed everywhere.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest
from places import REFERENCE, ROOT

from ffr_dyn.cli import main as dyn_main
from ffr_prep.cli import main as prep_main

MAIN = {"ffr-dyn": dyn_main, "ffr-prep": prep_main}
SHELL = set("|&;<>$`")  # what is for a shell to understand
PAGES = sorted(
    path for room in ("tutorials", "howto") for path in (ROOT / "docs" / room).glob("*.md") if path.stem != "index"
)
# Beginnings of commands that take long, and whose files nothing after them on the page reads.
SLOW = (
    "ffr-prep modes",
    "ffr-dyn response",
    "ffr-dyn run bearings.toml",
    "ffr-dyn chart",
    "ffr-dyn sweep tolerances.toml",
)
NUMBER = r"(?<![\w.])[-+]?\d+(?:\.\d*)?(?:e[-+]?\d+)?"
DIGITS = r"([-+]?\d+(?:\.\d*)?(?:e[-+]?\d+)?)"


def blocks(page: Path) -> list[tuple[str, str]]:
    """(language, text) of the blocks of a page, in order; files of the pages that it names come first."""
    text = page.read_text(encoding="utf-8")
    borrowed = [block for name in re.findall(r"<!-- files of (\S+) -->", text) for block in blocks(page.parent / name)]
    own = re.findall(r"^```(\w+)\n(.*?)^```$", text, re.S | re.M)
    return [block for block in borrowed if file_name(block)] + own


def file_name(block: tuple[str, str]) -> str:
    """The name of the file that a block is; none if it is none."""
    found = re.match(r"# (\S+\.(?:toml|csv|geo))\n", block[1])
    return found.group(1) if found and block[0] in ("toml", "text") else ""


def commands(text: str) -> list[tuple[str, list[str]]]:
    """(command, lines of output shown) of a block of a console."""
    made: list[tuple[str, list[str]]] = []
    for line in text.replace("\\\n", " ").splitlines():
        if line.startswith("$ "):
            made.append((line[2:], []))
        elif line.strip():
            made[-1][1].append(line)
    return made


def pattern(shown: str) -> str:
    """A regular expression for a shown line, with a group for each number."""
    pieces = []
    for piece in shown.split("..."):
        words = re.split(f"({NUMBER})", " ".join(piece.split()))
        pieces.append("".join(DIGITS if k % 2 else re.escape(word) for k, word in enumerate(words)))
    return ".*".join(pieces)


def shows(line: str, shown: str) -> bool:
    """Whether a line of output is what is shown."""
    found = re.fullmatch(pattern(shown), " ".join(line.split()))
    wanted = [float(number) for piece in shown.split("...") for number in re.findall(NUMBER, piece)]
    return bool(found) and np.allclose([float(number) for number in found.groups()], wanted, rtol=0.02, atol=0)


def assert_shown(output: str, shown: list[str]) -> None:
    """Lines that are shown are in the output, in this order."""
    lines = iter(output.splitlines())
    for one in (line for line in shown if line.strip() != "..."):
        assert any(shows(line, one) for line in lines), f"not printed: {one}\n{output}"


def test_lines_are_compared_by_words_and_numbers():
    assert shows("mass   0.2004 kg, 12 modes", "mass 0.2 kg, 12 modes")
    assert not shows("mass 0.21 kg", "mass 0.2 kg")
    assert not shows("mass 0.2 g", "mass 0.2 kg")
    assert shows("time read 0.3 s, write 0.4 s", "time ... write 0.4 s")
    assert commands("$ a \\\n b\n1\n\n2\n$ c\n") == [("a   b", ["1", "2"]), ("c", [])]


def in_a_shell(command: str) -> tuple[int, str]:
    """Exit code of a command, and all that it prints."""
    path = os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"]))
    called = ["bash", "-ec", command]
    done = subprocess.run(
        called,
        env={**os.environ, "PATH": path},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    return done.returncode, done.stdout


def in_this_process(command: str) -> tuple[int, str]:
    """The same of a command of this project, whose start takes longer than most of what they do."""
    words, code = shlex.split(command), 0
    with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stdout(io.StringIO()) as out:
        patch.setattr(sys, "argv", words)
        with contextlib.redirect_stderr(out):
            try:
                MAIN[words[0]]()
            except SystemExit as left:
                code = left.code
    return code, out.getvalue()


def typed(command: str, shown: list[str]) -> None:
    own = command.partition(" ")[0] in MAIN and not set(command) & SHELL
    code, output = in_this_process(command) if own else in_a_shell(command)
    assert (code, "Traceback" in output) == (0, False), f"{command}\n{output}"
    assert_shown(output, shown)


def has_slow_commands(page: Path) -> bool:
    texts = [text for language, text in blocks(page) if language == "console"]
    return any(command.startswith(SLOW) for text in texts for command, _ in commands(text))


def play(page: Path, folder: Path, without: tuple[str, ...] = ()) -> None:
    """Do in a folder what a page says, but for commands that begin so."""
    for package in " ".join(re.findall(r"<!-- needs (.+?) -->", page.read_text(encoding="utf-8"))).split():
        pytest.importorskip(package)
    (folder / "meshes").symlink_to(ROOT / "meshes")
    shutil.copy(REFERENCE / "plate.step", folder)
    space, printed = {"__name__": page.stem}, ""
    for block in blocks(page):
        language, text = block
        if file_name(block):
            (folder / file_name(block)).write_text(text, encoding="utf-8")
        elif language == "console":
            for command, shown in commands(text):
                if not command.startswith(without):
                    typed(command, shown)
        elif language == "python":
            with contextlib.redirect_stdout(io.StringIO()) as out:
                exec(compile(text, str(page), "exec"), space)
            printed = out.getvalue()
        elif language == "text":
            assert_shown(printed, text.splitlines())
    plt.close("all")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_page(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    play(page, tmp_path, without=SLOW)


@pytest.mark.slow
@pytest.mark.parametrize("page", [page for page in PAGES if has_slow_commands(page)], ids=lambda page: page.stem)
def test_the_whole_page(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    play(page, tmp_path)
