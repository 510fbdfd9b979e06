"""Files of HDF5 on a disk that is full from some byte on: a sentence, exit code 1 or 2, and nothing left over."""

import subprocess
import sys
from pathlib import Path

import pytest
from places import ROOT

COMMON = "import ffr_dyn as fd, numpy as np; from pathlib import Path; from ffr_prep.common.errors import *\n"
TABLE = """
from ffr_dyn.studies.table import Table, save_table
made = Table({"a": np.arange(400.0)}, {"b": np.arange(400.0)}, ("",) * 400)
act = lambda: save_table(made, "out.nc")
"""
VTK = """
from ffr_dyn.pictures.vtk_files import write_vtkhdf
from ffr_dyn.scene.scene import Body, Scene
from synthetic import cloud
scene = Scene((Body("b", cloud(2)),))
result = fd.forward(scene, end=0.01, output_step=0.005, method=fd.ROS2(1e-3))
act = lambda: write_vtkhdf(result, Path("out.vtkhdf"))
"""
END = """
import resource
resource.setrlimit(resource.RLIMIT_FSIZE, (MOST, MOST))
try:
    act()
except (ComputationError, InputError, OSError) as error:
    print(error)
"""


@pytest.mark.parametrize("limit", [0, 500, 3000])
@pytest.mark.parametrize("what", [TABLE, VTK], ids=["table", "vtkhdf"])
def test_a_full_disk_is_told_in_a_sentence(tmp_path, what, limit):
    paths = [str(ROOT), str(ROOT / "tests"), str(ROOT / "examples")]
    code = f"import sys; sys.path[:0] = {paths!r}\n{COMMON}{what}{END.replace('MOST', str(limit))}"
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert len(done.stdout.strip().splitlines()) == 1
    assert "File too large" in done.stdout
    assert list(Path(tmp_path).iterdir()) == []
