#!/usr/bin/env python3
"""Set up everything on a machine that has only git and python3, then run the demonstration, the site or the tests.

  python3 bootstrap.py demo      the connecting rod example, from its geometry to its animation
  python3 bootstrap.py site      the documentation, with its gallery executed; with --links also the addresses of others
  python3 bootstrap.py test      style, types, site and tests; with --slow also the longer tests

System packages that are missing are installed first (Debian and Ubuntu; as root or through sudo), then the project and
its libraries go into the folder .venv next to this file. What is there already is kept, so the second time starts at
once, and a set-up that was interrupted is completed by running it again.

Exit status: 0 all went well, 1 a test, the site or the demonstration failed, 2 this machine lacks something that the
message names.

It runs before anything is installed: nothing but Python 3.8 and its standard library here.
"""

from __future__ import annotations

import argparse
import ctypes
import hashlib
import json
import os
import shutil
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Iterator, Mapping, Sequence

HOME = Path(__file__).resolve().parent
OLDEST = (3, 11)
PYTHONS = ("python3", "python3.13", "python3.12", "python3.11", "python3.14")
PYTHON_PACKAGES = ("python3.11", "python3.11-venv")

# Shared libraries that the wheels of gmsh and VTK load from the system, and the Debian packages that bring them.
# Mesa's software renderer comes with libgl1 and libegl1.
LIBRARIES = {
    "libGLU.so.1": "libglu1-mesa",
    "libGL.so.1": "libgl1",
    "libEGL.so.1": "libegl1",
    "libXcursor.so.1": "libxcursor1",
    "libXft.so.2": "libxft2",
    "libXinerama.so.1": "libxinerama1",
    "libgomp.so.1": "libgomp1",
}
BROWSERS = ("chromium", "google-chrome", "chrome")

# Done together, since mypy takes one core for as long as all others. What is compiled here is found by the examples of the
# site and by the tests, which run side by side and would each compile the same.
CHECKS = {
    "ruff check": ("ruff", "check"),
    "ruff format": ("ruff", "format", "--check"),
    "mypy": ("mypy",),
    "kernels": (
        "python",
        "-c",
        "from ffr_dyn.compile.first_use import FORCES, ensure_compiled; from ffr_dyn.integrators import methods;"
        "ensure_compiled(*methods().values(), forces=FORCES)",
    ),
    "solvers": (
        *("ffr-prep", "reduce", "meshes/box.geo", "--material", "steel", "--interface", "left", "--interface", "right"),
        *("-o", "build/box.ffr"),
    ),
}
SITE = Path("build") / "site"
AS_TEXT = ("--define", "plot_gallery=0")
LINES_OF_AN_ERROR = 15
SIGNS_OF_NO_NETWORK = (
    "Temporary failure",
    "Failed to establish a new connection",
    "Name or service not known",
    "Could not resolve",
    "Could not connect",
    "Cannot connect to proxy",
    "Network is unreachable",
    "timed out",
)


class SetUpError(Exception):
    """Something that only the user can put right; the message says how."""


@dataclass(frozen=True)
class Stamp:
    """The stamp of an environment: the folder, the contents of pyproject.toml, and the extras installed."""

    home: str
    project: str
    extras: Sequence[str]


def main(arguments: Sequence[str] | None = None) -> int:
    """Set up and run what the command line asks for; returns the exit status."""
    options = _parser().parse_args(arguments)
    try:
        if options.command == "demo":
            set_up(extras=(), browser=False)
            return demo()
        if options.command == "site":
            set_up(extras=("docs",), browser=False)
            return site(links=options.links)
        set_up(extras=("bench", "docs", "test") if options.slow else ("docs", "test"), browser=options.slow)
        return test(slow=options.slow)
    except SetUpError as error:
        print(f"\n{error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("\nStopped. The same command goes on from here.", file=sys.stderr)
        return 130


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        description="Set up the project, then run its demonstration, its site or its tests."
    )
    commands = parser.add_subparsers(dest="command", required=True)
    commands.add_parser("demo", help="run the connecting rod example")
    pages = commands.add_parser("site", help="build the documentation, its gallery executed")
    pages.add_argument("--links", action="store_true", help="also ask for the addresses of others that pages name")
    tests = commands.add_parser("test", help="check style and types, build the site and run the tests")
    tests.add_argument("--slow", action="store_true", help="also the longer tests")
    return parser


def set_up(*, extras: Sequence[str], browser: bool) -> None:
    """Bring the machine and .venv to where the project runs."""
    packages = missing_packages(browser=browser)
    if packages:
        install_packages(packages)
        left = missing_packages(browser=browser)
        if left:
            raise SetUpError(f"Installed, and still not found: {' '.join(left)}. Is another Python first on the PATH?")
    make_environment(extras)


# ---- what runs ----------------------------------------------------------------------------------------------------


def demo() -> int:
    """The example of the README, shown as it runs."""
    print(flush=True)
    return 1 if subprocess.run([str(_program("python")), "examples/connecting_rod.py"], cwd=HOME).returncode else 0


def site(*, links: bool) -> int:
    """The pages, and where to open them."""
    passed = build_pages() and (not links or check("links", [*_pages("linkcheck"), *AS_TEXT]))
    print(HOME / SITE / "html" / "index.html")
    return 0 if passed else 1


def build_pages() -> bool:
    """Make all pages anew, every example executed."""
    remove_pages()
    return check("site", _pages("html"))


def remove_pages() -> None:
    for folder in (HOME / SITE / "html", HOME / "docs" / "gallery"):
        shutil.rmtree(folder, ignore_errors=True)


def _pages(builder: str) -> list[str]:
    """The command that makes the pages: all warnings are collected, and any of them fails."""
    strict = ["--quiet", "--nitpicky", "--fail-on-warning", "--keep-going", "--jobs", "auto"]
    return ["python", "-m", "sphinx", *strict, "--builder", builder, "docs", str(SITE / builder)]


def test(*, slow: bool) -> int:
    """Every check, and the tests last: their closing line ends the output."""
    passed = checked_in_full() if slow else checked()
    selection = ["-m", ""] if slow else []
    print("pytest", flush=True)
    # A process on every core, each of which does whole files, with one thread: together they would wait for each other.
    # In the order of the folders: by their number of tests, long ones would come last, and one core would wait.
    how = ["-n", "auto", "--dist", "loadfile", "--no-loadscope-reorder"]
    command = [str(_program("python")), "-m", "pytest", *how, *selection]
    tests = subprocess.run(command, cwd=HOME, env={**environment(), "OMP_NUM_THREADS": "1"})
    if tests.returncode < 0:
        print(f"\npytest was ended by signal {-tests.returncode}: its tests are not complete.", flush=True)
    return 0 if passed and tests.returncode == 0 else 1


def checked() -> bool:
    """All checks at once, with the pages as text: examples of the gallery are shown, not run."""
    remove_pages()
    return check_together({**CHECKS, "site": [*_pages("html"), *AS_TEXT]})


def checked_in_full() -> bool:
    """All checks, and the pages after them, whose examples find the kernels compiled then."""
    return all([check_together(CHECKS), build_pages()])


def check(title: str, command: Sequence[str]) -> bool:
    """Run one check; its output is shown only if it finds something."""
    return check_together({title: command})


def check_together(commands: Mapping[str, Sequence[str]]) -> bool:
    """Run checks side by side; whether all have passed."""
    with timed(", ".join(commands)), ThreadPoolExecutor(len(commands)) as at_once:
        done = list(at_once.map(lambda command: captured([str(_program(command[0])), *command[1:]]), commands.values()))
    for title, one in zip(commands, done):
        if one.returncode:
            print(f"{title} FAILED\n{one.stdout}", flush=True)
    return not any(one.returncode for one in done)


def _program(name: str) -> Path:
    return HOME / ".venv" / "bin" / name


# ---- the machine --------------------------------------------------------------------------------------------------


def missing_packages(*, browser: bool) -> list[str]:
    """Names of the Debian packages for everything that is not found on this machine."""
    packages = [] if _works(_program("python")) else missing_python_packages()
    packages += missing_library_packages()
    return packages + (missing_browser_packages() if browser else [])


def missing_python_packages() -> list[str]:
    """The interpreter, or the part of it that Debian keeps apart: the making of virtual environments."""
    python = find_python()
    if python is None:
        return list(PYTHON_PACKAGES)
    if can_make_environments(python):
        return []
    major, minor = version_of(python)
    return [f"python{major}.{minor}-venv"]


def missing_library_packages() -> list[str]:
    if sys.platform != "linux":
        return []
    return [package for library, package in LIBRARIES.items() if not _loads(library)]


def missing_browser_packages() -> list[str]:
    """A browser without a window, for the tests that open a page; Ubuntu has none that apt-get installs."""
    if any(shutil.which(name) for name in BROWSERS):
        return []
    if distribution() == "debian":
        return ["chromium"]
    print("No Chromium or Chrome here, and none that apt-get installs: the tests that open a page are skipped.")
    return []


def distribution() -> str:
    """The ID of /etc/os-release: "debian", "ubuntu", ...; empty where there is none."""
    try:
        lines = Path("/etc/os-release").read_text().splitlines()
    except OSError:
        return ""
    return next((line[3:].strip('"') for line in lines if line.startswith("ID=")), "")


def find_python() -> str | None:
    """An interpreter that is new enough, one that can make environments if there is one; None if there is none."""
    found = [sys.executable, *(path for path in map(shutil.which, PYTHONS) if path)]
    recent = [python for python in dict.fromkeys(found) if version_of(python) >= OLDEST]
    return next(filter(can_make_environments, recent), recent[0] if recent else None)


def version_of(python: str) -> tuple[int, int]:
    """(major, minor) of an interpreter; (0, 0) if it does not start."""
    done = captured([python, "-c", "import sys; print(*sys.version_info[:2])"])
    if done.returncode:
        return 0, 0
    major, minor = done.stdout.split()
    return int(major), int(minor)


def can_make_environments(python: str) -> bool:
    return captured([python, "-c", "import ensurepip, venv"]).returncode == 0


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def install_packages(packages: Sequence[str]) -> None:
    """Install Debian packages. Raises SetUpError, with the line to run, where this user may not."""
    names = " ".join(packages)
    if not shutil.which("apt-get"):
        raise SetUpError(f"This machine lacks what Debian calls: {names}.\nInstall that, then run this again.")
    rights = administrator()
    if rights is None:
        line = f"apt-get update && apt-get install -y --no-install-recommends {names}"
        raise SetUpError(
            f"Some system packages are missing. Let an administrator (root) run this line once:\n\n  {line}"
        )
    apt = [*rights, "env", "DEBIAN_FRONTEND=noninteractive", "apt-get", "-o", "DPkg::Lock::Timeout=300"]
    with timed(f"Installing system packages: {names}"):
        captured([*rights, "dpkg", "--configure", "-a"])  # completes an installation that was interrupted
        captured([*apt, "update"])  # where this fails, so does the next
        done = captured([*apt, "install", "-y", "--fix-broken", "--no-install-recommends", *packages])
    if done.returncode:
        raise SetUpError(_failure(f"apt-get could not install {names}", done.stdout))


def administrator() -> list[str] | None:
    """The words in front of a command that make it run as root; None if this user cannot."""
    if os.geteuid() == 0:
        return []
    if not shutil.which("sudo"):
        return None
    if captured(["sudo", "-n", "true"]).returncode == 0:
        return ["sudo", "-n"]
    if not sys.stdin.isatty():
        return None
    print("System packages must be installed; sudo asks for your password.", flush=True)
    return ["sudo"] if subprocess.run(["sudo", "-v"]).returncode == 0 else None


# ---- the environment ----------------------------------------------------------------------------------------------


def make_environment(extras: Sequence[str]) -> None:
    """Make .venv, or bring it up to date; nothing if it was made for this folder, this pyproject.toml and the extras.

    The stamp is written last and removed first: an environment without one was interrupted and is made anew.
    """
    folder = HOME / ".venv"
    stamp = folder / "stamp.json"
    project = hashlib.sha256((HOME / "pyproject.toml").read_bytes()).hexdigest()
    made = _read(stamp)
    intact = made is not None and made.home == str(HOME) and _works(_program("python"))
    if made and intact and made.project == project and set(extras) <= set(made.extras):
        return
    if not intact:
        _make_empty(folder)
    stamp.unlink(missing_ok=True)
    wanted = sorted({*extras, *(made.extras if made and intact else ())})
    _install(wanted)
    stamp.write_text(json.dumps(asdict(Stamp(str(HOME), project, wanted))))


def _read(stamp: Path) -> Stamp | None:
    """The stamp, or None where there is none or it makes no sense."""
    try:
        return Stamp(**json.loads(stamp.read_text()))
    except (OSError, ValueError, TypeError):
        return None


def _works(python: Path) -> bool:
    """Whether the environment's interpreter starts and finds the project (not so after an upgrade of Python)."""
    return python.exists() and captured([str(python), "-I", "-c", "import ffr_prep, ffr_dyn"]).returncode == 0


def _make_empty(folder: Path) -> None:
    python = find_python()
    if python is None:
        raise SetUpError(f"No Python {OLDEST[0]}.{OLDEST[1]} or newer was found.")
    with timed(f"Making the environment {folder.name} with Python {'.'.join(map(str, version_of(python)))}"):
        done = captured([python, "-m", "venv", "--clear", str(folder)])
    if done.returncode:
        raise SetUpError(_failure("The environment could not be made", done.stdout))


def _install(extras: Sequence[str]) -> None:
    project = f"{HOME}[{','.join(extras)}]" if extras else str(HOME)
    pip = [str(_program("python")), "-m", "pip", "install", "--no-input", "--disable-pip-version-check"]
    with timed("Installing the project and its libraries (some hundred megabytes)"):
        done = captured([*pip, "--editable", project])
    if done.returncode:
        raise SetUpError(_failure("pip could not install the libraries", done.stdout))


# ---- commands and messages ----------------------------------------------------------------------------------------


def captured(command: Sequence[str]) -> subprocess.CompletedProcess[str]:
    """Run a command quietly in the project's folder; stdout of the answer holds all it printed."""
    return subprocess.run(
        command,
        cwd=HOME,
        env=environment(),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        encoding="utf-8",
        errors="replace",
    )


def environment() -> dict[str, str]:
    """Of what runs here. Modules stay compiled on disk: the tests start hundreds of processes that load the same ones."""
    return {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}


@contextmanager
def timed(title: str) -> Iterator[None]:
    """Say what is being done, and how long it took."""
    print(f"{title} ...", end="", flush=True)
    start = time.monotonic()
    try:
        yield
    finally:
        print(f" {time.monotonic() - start:.1f} s", flush=True)


def _failure(what: str, output: str) -> str:
    """The message of a command that failed: the end of what it said, without its warnings."""
    lines = [line for line in output.splitlines() if line.strip() and "WARNING: " not in line]
    shown = "\n".join(f"  {line}" for line in lines[-LINES_OF_AN_ERROR:])
    offline = any(sign in output for sign in SIGNS_OF_NO_NETWORK)
    advice = (
        "The network was not reachable: run this again when it is."
        if offline
        else "Put that right, then run this again."
    )
    return f"{what}. It said:\n\n{shown}\n\n{advice}"


if __name__ == "__main__":
    sys.exit(main())
