"""The set-up: what it finds missing, what it installs, when it starts anew, and what it says when it cannot go on."""

from __future__ import annotations

import ast
import io
import os
import subprocess
import sys
from pathlib import Path

import pytest
from places import ROOT

import bootstrap
from bootstrap import SetUpError


class Machine:
    """Stands in for the commands that `bootstrap` runs: keeps a record, and fails those that contain a word of `bad`."""

    def __init__(self, bad=()):
        self.bad = set(bad)
        self.commands = []
        self.complaint = "no route\n"

    def __call__(self, command, **_):
        command = [str(word) for word in command]
        self.commands.append(command)
        failed = bool(self.bad & set(command))
        if not failed and "venv" in command:
            python = Path(command[-1]) / "bin" / "python"
            python.parent.mkdir(parents=True, exist_ok=True)
            python.touch()
        return subprocess.CompletedProcess(command, int(failed), stdout=self.complaint if failed else "3 11")

    def ran(self, word):
        return [command for command in self.commands if word in command]


@pytest.fixture
def machine(monkeypatch, tmp_path):
    """A machine where every command succeeds, every library loads, and the checkout is an empty folder."""
    machine = Machine()
    monkeypatch.setattr(bootstrap, "captured", machine)
    monkeypatch.setattr(bootstrap.subprocess, "run", machine)
    monkeypatch.setattr(bootstrap, "HOME", tmp_path)
    monkeypatch.setattr(bootstrap, "_loads", lambda library: True)
    monkeypatch.setattr(bootstrap.shutil, "which", lambda name: f"/usr/bin/{name}")
    monkeypatch.setattr(bootstrap.os, "geteuid", lambda: 0)
    (tmp_path / "pyproject.toml").write_text("[project]\n")
    return machine


# ---- before anything is installed -----------------------------------------------------------------------------------


def test_it_runs_before_anything_is_installed():
    """Nothing but Python 3.8 and its standard library."""
    tree = ast.parse((ROOT / "bootstrap.py").read_text(encoding="utf-8"), feature_version=(3, 8))
    imported = [node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    imported += [alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names]
    assert len(imported) > 5
    assert {name.partition(".")[0] for name in imported} <= set(sys.stdlib_module_names)


def test_help_names_both_commands():
    done = subprocess.run([sys.executable, "bootstrap.py", "--help"], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0
    assert "demo" in done.stdout
    assert "test" in done.stdout


def test_continuous_integration_runs_the_second_command_and_nothing_else():
    script = ROOT / ".ci" / "run"
    assert os.access(script, os.X_OK)
    last = script.read_text(encoding="utf-8").splitlines()[-1]
    assert last.endswith("&& exec python3 bootstrap.py test")


# ---- what is missing ------------------------------------------------------------------------------------------------


def test_nothing_is_missing_where_everything_is_found(machine):
    assert bootstrap.missing_packages(browser=True) == []


def test_only_missing_libraries_are_asked_for(machine, monkeypatch):
    monkeypatch.setattr(bootstrap, "_loads", lambda library: library not in {"libGLU.so.1", "libXft.so.2"})
    assert bootstrap.missing_packages(browser=False) == ["libglu1-mesa", "libxft2"]


def test_a_library_that_does_not_exist_is_not_found():
    assert not bootstrap._loads("libNobodyHasThis.so.9")


@pytest.mark.skipif(sys.platform != "linux", reason="the C library has this name on Linux")
def test_a_library_that_exists_is_found():
    assert bootstrap._loads("libc.so.6")


def test_the_part_of_python_that_debian_keeps_apart_is_asked_for(machine):
    machine.bad = {"import ensurepip, venv"}
    assert bootstrap.missing_packages(browser=False) == ["python3.11-venv"]


def test_a_newer_python_is_asked_for_where_there_is_none(machine, monkeypatch):
    monkeypatch.setattr(bootstrap, "version_of", lambda python: (3, 10))
    assert bootstrap.missing_packages(browser=False) == ["python3.11", "python3.11-venv"]


def test_a_newer_python_beside_an_old_one_is_found(machine, monkeypatch):
    monkeypatch.setattr(bootstrap, "version_of", lambda python: (3, 12) if python.endswith("3.12") else (3, 10))
    assert bootstrap.find_python() == "/usr/bin/python3.12"


def test_a_python_that_makes_environments_is_preferred(machine, monkeypatch):
    monkeypatch.setattr(bootstrap, "version_of", lambda python: (3, 13))
    monkeypatch.setattr(bootstrap, "can_make_environments", lambda python: python.endswith("3.13"))
    assert bootstrap.find_python() == "/usr/bin/python3.13"


def test_a_python_that_does_not_start_has_no_version(machine):
    machine.bad = {"/broken/python"}
    assert bootstrap.version_of("/broken/python") == (0, 0)


def test_an_environment_that_works_needs_no_other_python(machine, monkeypatch, tmp_path):
    bootstrap.make_environment(())
    monkeypatch.setattr(bootstrap, "find_python", lambda: None)
    assert bootstrap.missing_packages(browser=False) == []


@pytest.mark.parametrize(("system", "packages"), [("debian", ["chromium"]), ("ubuntu", [])])
def test_a_browser_is_installed_where_it_is_a_package(machine, monkeypatch, capsys, system, packages):
    monkeypatch.setattr(bootstrap.shutil, "which", lambda name: None)
    monkeypatch.setattr(bootstrap, "distribution", lambda: system)
    assert bootstrap.missing_browser_packages() == packages
    assert ("are skipped" in capsys.readouterr().out) == (packages == [])


# ---- installing packages --------------------------------------------------------------------------------------------


def test_exactly_the_missing_packages_are_installed(machine):
    bootstrap.install_packages(["libgl1", "libxft2"])
    (install,) = machine.ran("install")
    assert install[-2:] == ["libgl1", "libxft2"]
    assert "--no-install-recommends" in install
    assert machine.commands.index(install) > machine.commands.index(machine.ran("update")[0])
    assert not machine.ran("sudo")


def test_without_root_sudo_is_used(machine, monkeypatch):
    monkeypatch.setattr(bootstrap.os, "geteuid", lambda: 1000)
    bootstrap.install_packages(["libgl1"])
    assert machine.ran("install")[0][:2] == ["sudo", "-n"]


def test_without_root_and_sudo_the_line_to_run_is_named(machine, monkeypatch, capsys):
    monkeypatch.setattr(bootstrap.os, "geteuid", lambda: 1000)
    monkeypatch.setattr(bootstrap.shutil, "which", lambda name: None if name == "sudo" else f"/usr/bin/{name}")
    monkeypatch.setattr(bootstrap, "_loads", lambda library: library != "libGL.so.1")
    assert bootstrap.main(["test"]) == 2
    line = "  apt-get update && apt-get install -y --no-install-recommends libgl1\n"
    assert line in capsys.readouterr().err
    assert not machine.ran("install")


def test_a_password_is_not_waited_for_where_nobody_can_type_it(machine, monkeypatch):
    machine.bad = {"true"}
    monkeypatch.setattr(bootstrap.os, "geteuid", lambda: 1000)
    monkeypatch.setattr(bootstrap.sys, "stdin", io.StringIO())
    assert bootstrap.administrator() is None


def test_another_system_is_told_what_it_lacks(machine, monkeypatch):
    monkeypatch.setattr(bootstrap.shutil, "which", lambda name: None)
    with pytest.raises(SetUpError, match="Debian calls: libgl1"):
        bootstrap.install_packages(["libgl1"])


def test_a_failed_installation_says_what_apt_said(machine):
    machine.bad = {"install"}
    with pytest.raises(SetUpError, match=r"apt-get could not install(.|\n)*no route(.|\n)*Put that right"):
        bootstrap.install_packages(["libgl1"])


@pytest.mark.parametrize(
    "step", [lambda: bootstrap.install_packages(["libgl1"]), lambda: bootstrap.make_environment(())]
)
def test_a_missing_network_is_named(machine, step):
    machine.bad = {"install"}
    machine.complaint = "WARNING: Retrying\nE: Temporary failure resolving 'a.b'\n"
    with pytest.raises(SetUpError, match="The network was not reachable: run this again") as caught:
        step()
    assert "Temporary failure resolving" in str(caught.value)
    assert "Retrying" not in str(caught.value)


def test_packages_that_change_nothing_are_reported(machine, monkeypatch):
    monkeypatch.setattr(bootstrap, "_loads", lambda library: library != "libGL.so.1")
    with pytest.raises(SetUpError, match="still not found: libgl1"):
        bootstrap.set_up(extras=(), browser=False)


# ---- the environment ------------------------------------------------------------------------------------------------


def steps(machine):
    """What was done to the environment since the last look."""
    done = [
        "make" if "venv" in command else command[-1] for command in machine.commands if {"venv", "pip"} & set(command)
    ]
    machine.commands.clear()
    return done


def test_an_environment_is_made_once(machine, tmp_path):
    bootstrap.make_environment(("test",))
    assert steps(machine) == ["make", f"{tmp_path}[test]"]
    bootstrap.make_environment(("test",))
    bootstrap.make_environment(())
    assert steps(machine) == []


def test_what_is_installed_grows(machine, tmp_path):
    bootstrap.make_environment(())
    assert steps(machine) == ["make", str(tmp_path)]
    bootstrap.make_environment(("test",))
    assert steps(machine) == [f"{tmp_path}[test]"]


def test_a_changed_project_is_installed_again(machine, tmp_path):
    bootstrap.make_environment(("test",))
    steps(machine)
    (tmp_path / "pyproject.toml").write_text("[project]\nname = 'other'\n")
    bootstrap.make_environment(())
    assert steps(machine) == [f"{tmp_path}[test]"]


def test_an_interrupted_installation_is_made_anew(machine, tmp_path):
    machine.bad = {"pip"}
    with pytest.raises(SetUpError, match=r"pip could not install(.|\n)*no route(.|\n)*Put that right"):
        bootstrap.make_environment(())
    assert not (tmp_path / ".venv" / "stamp.json").exists()
    machine.bad = set()
    steps(machine)
    bootstrap.make_environment(())
    assert steps(machine) == ["make", str(tmp_path)]


def test_a_failed_update_is_not_taken_for_done(machine, tmp_path):
    bootstrap.make_environment(())
    machine.bad = {"pip"}
    with pytest.raises(SetUpError, match="pip could not install"):
        bootstrap.make_environment(("test",))
    machine.bad = set()
    steps(machine)
    bootstrap.make_environment(())
    assert steps(machine) == ["make", str(tmp_path)]


def test_a_moved_checkout_is_made_anew(machine, monkeypatch, tmp_path):
    bootstrap.make_environment(())
    steps(machine)
    moved = tmp_path / "moved"
    moved.mkdir()
    for name in (".venv", "pyproject.toml"):
        (tmp_path / name).rename(moved / name)
    monkeypatch.setattr(bootstrap, "HOME", moved)
    bootstrap.make_environment(())
    assert steps(machine) == ["make", str(moved)]


@pytest.mark.parametrize("stamp", ["", "[]", '{"home": "x"}', "\x00"])
def test_a_damaged_stamp_is_none(tmp_path, stamp):
    (tmp_path / "stamp.json").write_text(stamp)
    assert bootstrap._read(tmp_path / "stamp.json") is None


def test_an_environment_that_cannot_be_made_says_so(machine):
    machine.bad = {"venv"}
    with pytest.raises(SetUpError, match="environment could not be made"):
        bootstrap.make_environment(())


# ---- what runs ------------------------------------------------------------------------------------------------------


def test_the_tests_come_last(machine):
    assert bootstrap.test(slow=False) == 0
    first, (site, tests) = machine.commands[:-2], machine.commands[-2:]
    assert sorted(Path(command[0]).name for command in first) == ["ffr-prep", "mypy", "python", "ruff", "ruff"]
    assert site[1:3] == ["-m", "sphinx"]
    assert tests[1:] == ["-m", "pytest", "-n", "auto", "--dist", "loadfile", "--no-loadscope-reorder"]


def test_what_runs_leaves_its_modules_compiled(monkeypatch):
    monkeypatch.setenv("PYTHONDONTWRITEBYTECODE", "1")
    asked = bootstrap.captured([sys.executable, "-c", "import sys; print(sys.dont_write_bytecode)"])
    assert asked.stdout.strip() == "False"


def test_slow_selects_every_test(machine):
    bootstrap.test(slow=True)
    assert machine.commands[-1][-2:] == ["-m", ""]


@pytest.mark.parametrize(
    ("options", "extras", "browser"), [([], ("docs", "test"), False), (["--slow"], ("bench", "docs", "test"), True)]
)
def test_the_longer_tests_need_a_browser_and_the_benchmarks(machine, monkeypatch, options, extras, browser):
    asked = []
    monkeypatch.setattr(bootstrap, "set_up", lambda **wanted: asked.append(wanted))
    assert bootstrap.main(["test", *options]) == 0
    assert asked == [{"extras": extras, "browser": browser}]


@pytest.mark.parametrize(("options", "builders"), [([], ["html"]), (["--links"], ["html", "linkcheck"])])
def test_the_site_is_built_and_its_addresses_asked_for_on_request(machine, options, builders, capsys):
    assert bootstrap.main(["site", *options]) == 0
    made = machine.ran("sphinx")
    assert [command[command.index("--builder") + 1] for command in made] == builders
    assert all("--fail-on-warning" in command for command in made)
    assert "index.html" in capsys.readouterr().out


def test_a_site_with_a_warning_fails(machine):
    machine.bad = {"sphinx"}
    assert bootstrap.main(["site"]) == 1


@pytest.mark.parametrize("word", ["check", "format", "reduce", "sphinx", "pytest"])
def test_any_failed_check_fails(machine, word):
    machine.bad = {word}
    assert bootstrap.test(slow=False) == 1
    assert machine.ran("pytest")


def test_tests_that_were_killed_say_so(machine, monkeypatch, capsys):
    killed = subprocess.CompletedProcess([], -9)
    monkeypatch.setattr(bootstrap.subprocess, "run", lambda command, **_: killed)
    assert bootstrap.test(slow=False) == 1
    assert "ended by signal 9" in capsys.readouterr().out


def test_a_failed_check_shows_what_it_found(machine, capsys):
    machine.bad = {"check"}
    bootstrap.check("ruff check", ("ruff", "check"))
    assert "ruff check FAILED\nno route" in capsys.readouterr().out


def test_the_demonstration_passes_its_status_on(machine):
    assert bootstrap.demo() == 0
    machine.bad = {"examples/connecting_rod.py"}
    assert bootstrap.demo() == 1
    assert (ROOT / "examples" / "connecting_rod.py").exists()


def test_an_interrupt_says_how_to_go_on(machine, monkeypatch, capsys):
    def interrupted(**_):
        raise KeyboardInterrupt

    monkeypatch.setattr(bootstrap, "set_up", interrupted)
    assert bootstrap.main(["demo"]) == 130
    assert "goes on from here" in capsys.readouterr().err
