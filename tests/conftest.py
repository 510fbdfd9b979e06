"""What holds for every test."""

import signal
import sys
from pathlib import Path

import pytest
import scipy.linalg  # noqa: F401 - a library must be loaded before it can be limited
from threadpoolctl import threadpool_limits

from ffr_prep.common.registry import plugins

# Tests borrow scenes and bodies from each other across the folders.
sys.path += sorted(str(folder) for folder in Path(__file__).parent.rglob("[!_.]*") if folder.is_dir())

# One BLAS thread: as `fp.reduce` has it, so that what a test computes beside it is equal bit by bit.
threadpool_limits(1)


SLOW_CASES = Path(__file__).with_name("slow_cases.txt")


def slow_cases() -> set[str]:
    """Node ids, from the folder of the tests, of `slow_cases.txt`."""
    found, test = set[str](), ""
    for line in SLOW_CASES.read_text(encoding="utf-8").splitlines():
        if line.startswith("  "):
            found.add(f"{test}[{line[2:]}]")
        elif not line.startswith("#"):
            test = line
    return found


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark the slow cases. Raises UsageError where the tests are collected as a whole and one is not among them."""
    missing = slow_cases()
    for item in items:
        name = item.nodeid.removeprefix("tests/")
        if name in missing:
            missing.remove(name)
            item.add_marker(pytest.mark.slow)
    if missing and config.args in (["tests"], [str(config.rootpath / "tests")]):
        raise pytest.UsageError(f"{SLOW_CASES.name} names cases that are gone: {', '.join(sorted(missing))}")


@pytest.fixture(autouse=True)
def signals_are_handled_as_before():
    """A command that is interrupted in this process ignores what else asks it to end; other tests want to be asked."""
    ending = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    before = [signal.getsignal(number) for number in ending]
    yield
    for number, handler in zip(ending, before, strict=True):
        signal.signal(number, handler)


@pytest.fixture(autouse=True)
def broken_pipes_raise():
    """gmsh, where a test calls it in this process, lets a write to a dead child kill the process; undo that."""
    yield
    signal.signal(signal.SIGPIPE, signal.SIG_IGN)


@pytest.fixture(autouse=True)
def plugins_are_gone():
    """Code of a user that a test has loaded, often from a folder that ends with it: workers would load it, too."""
    before = set(plugins())
    yield
    for path in set(plugins()) - before:
        del sys.modules[f"ffr_plugin:{path}"]
