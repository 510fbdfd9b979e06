"""Where things are in a checkout."""

from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
MESHES = ROOT / "meshes"
TESTS = ROOT / "tests"
REFERENCE = TESTS / "reference"
