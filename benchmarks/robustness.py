"""Mutated inputs, kills and full disks: counts of outcomes.

    python -m benchmarks.robustness [INPUTS [KILLS [DISKS]]]     # by default 100000, 200, 50

Inputs: sound files of every format, changed by chance, are read in processes with 2 GB of address space. Each must be read or
refused in a line, within 10 s; `unforeseen` are those that only the net around a reader refused. Formats that a process of
the mesher reads get a twentieth.

Kills: runs that are ended by SIGKILL, SIGTERM, SIGHUP or SIGINT at a random moment and go on with --resume. Disks: runs whose
file may not grow beyond a random size. No row that was flushed may be lost, and the whole must equal a run that was never
stopped to the bit.
"""

from __future__ import annotations

import argparse
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests"))
sys.path += sorted(str(folder) for folder in (ROOT / "tests").rglob("[!_.]*") if folder.is_dir())

from mutated_inputs import FINE, SLOW, count, formats, make_samples  # noqa: E402

from ffr_dyn.results.file import load_result  # noqa: E402
from ffr_prep.common.errors import InputError  # noqa: E402

SCENE = """
gravity = [0, -9.81, 0]
[analysis]
end = 1e6
output_step = 0.1
step = 1e-3
[ground]
O = [0, 0, 0]
[bodies.bar]
mass = 1.0
inertia = [0.1, 0.1, 0.1]
points = {a = [0, 0, 0], b = [1, 0, 0]}
[joints.hinge]
kind = "revolute"
i = "ground.O"
j = "bar.a"
"""
SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGHUP, signal.SIGINT)


def inputs(total: int, folder: Path) -> bool:
    """Mutated inputs of all formats; whether all came out fine."""
    samples = folder / "samples"
    samples.mkdir()
    make_samples(samples)
    names = list(formats())
    share = total / sum(1 / SLOW.get(name, 1) for name in names)
    whole: Counter[str] = Counter()
    for name in names:
        counted = count(name, samples, round(share / SLOW.get(name, 1)))
        whole += counted.of
        told = ", ".join(f"{number} {word}" for word, number in counted.of.most_common())
        print(f"{name:14} {told}; the slowest {counted.slowest:.1f} s", *counted.wrong[:5], flush=True)
    print(f"inputs         {whole.total()}: {', '.join(f'{number} {word}' for word, number in whole.most_common())}")
    return set(whole) <= set(FINE)


def start(scene: Path, output: Path, *options: str, limit: int | None = None) -> subprocess.Popen[str]:
    def limited() -> None:
        signal.signal(signal.SIGINT, signal.SIG_DFL)  # which a shell in the background has its children ignore
        if limit is not None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

    command = [sys.executable, "-m", "ffr_dyn.cli", "run", str(scene), "-o", str(output), *options]
    pipes = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE}
    return subprocess.Popen(command, cwd=ROOT, text=True, preexec_fn=limited, **pipes)  # type: ignore[call-overload]


def kept(output: Path) -> int:
    """Rows of a result file; none where there is no file."""
    try:
        return load_result(output).time.size
    except InputError:
        if output.exists():
            raise
        return 0


def losses(kills: int, disks: int, folder: Path) -> bool:
    """Stopped runs and what became of them; whether nothing was lost."""
    scene, output, whole, random = folder / "scene.toml", folder / "x.nc", folder / "whole.nc", np.random.default_rng(1)
    scene.write_text(SCENE)
    said: Counter[str] = Counter()
    rows, began = 0, time.monotonic()
    start(scene, folder / "first.nc", "--end", "1.0").communicate()
    longest = 2.0 + time.monotonic() - began  # s, so that most are hit while they write rows
    for k in range(kills):
        run = start(scene, output, "--resume")
        time.sleep(float(random.uniform(0.0, longest)))
        run.send_signal(SIGNALS[k % len(SIGNALS)])
        run.communicate()
        said[f"{SIGNALS[k % len(SIGNALS)].name} -> {run.returncode}"] += 1
        now = kept(output)
        said["rows lost"] += now < rows
        rows = now
    print(f"kills          {kills}: {rows} rows; {dict(said)}", flush=True)
    lost = said["rows lost"]
    for _ in range(disks):
        limit = output.stat().st_size + int(random.uniform(0, 3e6)) if output.exists() else int(random.uniform(0, 3e6))
        run = start(scene, output, "--resume", limit=limit)
        words = run.communicate()[1]
        said[f"disk -> {run.returncode}, {len(words.strip().splitlines())} line"] += 1
        now = kept(output)
        lost += now < rows
        rows = now
    end = f"{0.1 * (rows + 9):.9g}"
    for path in (output, whole):
        start(scene, path, "--end", end, "--resume").communicate()
    one, other = load_result(output), load_result(whole)
    equal = all(np.array_equal(one[name], other[name]) for name in other.quantities)
    print(f"disks          {disks}: {rows} rows; {dict(said)}; resumed {'equal to the bit' if equal else 'DIFFERENT'}")
    return equal and not lost


def main() -> int:
    """Print what was found."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="?", type=int, default=100_000, help="changed by chance, to be read")
    parser.add_argument("kills", nargs="?", type=int, default=200, help="of runs")
    parser.add_argument("disks", nargs="?", type=int, default=50, help="that are full")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="ffr-robustness-") as folder:
        fine = [inputs(given.files, Path(folder)), losses(given.kills, given.disks, Path(folder))]
    return 0 if all(fine) else 1


if __name__ == "__main__":
    sys.exit(main())
