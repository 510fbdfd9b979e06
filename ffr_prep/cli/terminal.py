"""Messages of ffr-prep at the terminal: the steps of the work, their progress, and the outcome."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

import click

from ffr_prep.common.process_memory import begin_peak, in_words, peak

LONGEST = 3  # steps that are told when all is done; on a terminal each is told as it ends
_PAUSE = 0.2  # seconds between two looks at how far a step is


@dataclass(frozen=True)
class Step:
    """A step that has ended: its name, the seconds it took, and the most memory [bytes] while it ran, if that is known."""

    name: str
    seconds: float
    memory: int | None


@dataclass
class Steps:
    """Notes time and memory of each step of the work; tells of them, and of how far they are, on a terminal.

    An instance is the `progress` of a reduction, and its method `advance` the `advance`.
    """

    visible: bool
    ended: list[Step] = field(default_factory=list)
    _name: str = ""
    _since: float = 0.0
    _told: float = 0.0

    def __call__(self, step: str) -> None:
        """A step begins, and the one before ends."""
        self.end()
        begin_peak()
        self._name, self._since = step, time.perf_counter()
        self._tell(f"{step} ... ")

    def advance(self, share: float, words: str) -> None:
        """How far the step is."""
        now = time.perf_counter()
        if now - self._told >= _PAUSE:
            self._told = now
            self._tell(f"\r{self._name} ... {100 * share:.0f} %, {words} \x1b[K")

    def end(self) -> None:
        """The step ends and no other begins."""
        if not self._name:
            return
        step = Step(self._name, time.perf_counter() - self._since, peak())
        told = f"\r{step.name} ... \x1b[K" if self._told > self._since else ""
        self._tell(f"{told}{_end_in_words(step)}\n")
        self.ended.append(step)
        self._name = ""

    def lines(self) -> Iterable[str]:
        """Time and memory of the work, with its longest steps and with the one that needed most memory."""
        total = sum(step.seconds for step in self.ended)
        longest = sorted(self.ended, key=lambda step: -step.seconds)[:LONGEST]
        listed = ", ".join(f"{step.name} {step.seconds:.1f} s" for step in longest)
        yield f"time        {total:.1f} s; the longest steps: {listed}"
        largest = max(self.ended, key=lambda step: step.memory or 0)
        where = f" at most ({largest.name})" if largest.memory else ""
        yield f"memory      {in_words(largest.memory)}{where}"

    def _tell(self, text: str) -> None:
        if self.visible:
            click.echo(text, err=True, nl=False)


def _end_in_words(step: Step) -> str:
    memory = f", {in_words(step.memory)}" if step.memory else ""
    return f"{step.seconds:.1f} s{memory}"


def terminal_steps() -> Steps:
    """Steps that are told where somebody looks."""
    return Steps(visible=sys.stderr.isatty())


def show(lines: Iterable[str]) -> None:
    """Print the lines."""
    for line in lines:
        click.echo(line)


def filed(output: Path) -> None:
    """Where the result is."""
    click.echo(f"file        {output}, {output.stat().st_size / 1024:.0f} kB")
