"""The table, the values, the picture and the page of faces; the page in a browser."""

from __future__ import annotations

import html
import json
import re
import shutil
import subprocess

import numpy as np
import pytest
from parts import plate, written
from PIL import Image

import ffr_prep as fp
from ffr_prep.report.face_page import page_of
from ffr_prep.report.faces import face_lines, face_values

BROWSER = shutil.which("chromium") or shutil.which("google-chrome") or shutil.which("chrome")
FLAGS = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--window-size=1200,700",
    "--virtual-time-budget=4000",
    "--dump-dom",
]


@pytest.fixture(scope="module")
def faces(tmp_path_factory):
    return fp.faces(written(plate, tmp_path_factory.mktemp("part") / "plate.step"))


def test_a_line_for_each_surface_tells_what_to_type(faces):
    head, titles, *lines = face_lines(faces)
    assert head == "faces       22, which are 10 surfaces; extent (120, 80, 10) mm"
    assert titles.endswith("what to type")
    assert len(lines) == 10
    bores = [line for line in lines if "bore r 6" in line]
    assert bores[-1].endswith("cylinder r=6mm at 45,25,0mm")
    assert bores[-1].startswith("surface_19+surface_20+surface_21+surface_22")


def test_values_are_json(faces):
    values = json.loads(json.dumps(face_values(faces)))
    assert values["unit"] == "mm"
    assert len(values["faces"]) == 22
    bore = next(face for face in values["faces"] if face["kind"] == "cylinder")
    assert bore["radius"] == pytest.approx(0.006)
    assert {"faces": ["surface_3"], "type": "plane z=5mm"} in values["features"]


def test_faces_show_themselves_in_short(faces):
    assert repr(faces).startswith("22 faces, 10 features")
    assert len(repr(faces)) < 1000
    assert faces._repr_html_().count("<tr>") == 10
    assert "<td>plane z=5mm  (plane, normal " in faces._repr_html_()


@pytest.mark.slow
def test_the_picture_numbers_what_is_seen(faces, tmp_path):
    path = fp.face_picture(faces, tmp_path / "plate.png")
    picture = np.asarray(Image.open(path).convert("RGB")).astype(int)
    assert (np.ptp(picture, axis=2) > 20).mean() > 0.1  # coloured faces
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 50


def test_the_page_is_one_small_file_that_asks_for_nothing(faces, tmp_path):
    path = fp.face_page(faces, tmp_path / "plate.html", "a <part>")
    text = path.read_text("utf-8")
    assert len(text) < 200_000
    assert re.findall(r"(?:https?:)?//[\w.]+\.\w+|\bfetch\(|XMLHttpRequest|@import|<link|src=", text) == []
    assert "a &lt;part&gt;" in text


CLICKS = """<script>
window.onerror = message => document.title = "ERROR " + message;
addEventListener("load", () => setTimeout(() => {
  const canvas = document.getElementById("view"), box = canvas.getBoundingClientRect(), told = [];
  const click = (x, y, more) => {
    const e = { bubbles: true, clientX: box.left + x, clientY: box.top + y, button: 0, pointerId: 1, ...more };
    canvas.dispatchEvent(new PointerEvent("pointerdown", e)); canvas.dispatchEvent(new PointerEvent("pointerup", e));
    told.push(document.getElementById("type").value); };
  const at = v => { const q = seen(v), s = scales();
    return [((q[0] - shift[0]) * s[0] + 1) / 2 * canvas.clientWidth,
            (1 - (q[1] - shift[1]) * s[1]) / 2 * canvas.clientHeight]; };
  const middle = face => { let best = [-Infinity];  // of the triangle that is nearest to the viewer
    for (let k = 0; k < owner.length; k++) if (owner[k] === face) {
      const corners = [0, 1, 2].map(j => at(T[3 * k + j]));
      const z = [0, 1, 2].map(j => seen(T[3 * k + j])[2] / 3).reduce((a, b) => a + b);
      const p = [0, 1].map(j => (corners[0][j] + corners[1][j] + corners[2][j]) / 3);
      if (faceAt(...p) === face && z > best[0]) best = [z, p]; }
    return best[1]; };
  const index = name => D.faces.findIndex(f => f.name === name);
  click(...middle(index("surface_3")));
  const bore = [19, 20, 21, 22].map(k => index("surface_" + k)).find(f => middle(f));
  click(...middle(bore));
  click(...middle(bore), { altKey: true });
  click(...middle(index("surface_3")), { shiftKey: true });
  click(3, 3);
  document.getElementById("name").value = "pin"; document.getElementById("name").dispatchEvent(new Event("input"));
  document.getElementById("list").children[0].click();
  told.push(document.getElementById("type").value, gl ? "drawn" : "no WebGL2");
  document.title = JSON.stringify(told);
}, 300));
</script></body>"""


@pytest.mark.slow
@pytest.mark.skipif(BROWSER is None, reason="no chromium or google-chrome on this machine")
def test_a_click_tells_what_to_type(faces, tmp_path):
    page = tmp_path / "plate.html"
    page.write_text(page_of(faces, "plate").replace("</body>", CLICKS), encoding="utf-8")
    command = [BROWSER, *FLAGS, f"--user-data-dir={tmp_path / 'browser'}", page.as_uri()]
    done = subprocess.run(command, check=True, capture_output=True, text=True, timeout=180)
    title = html.unescape(re.search(r"<title>(.*?)</title>", done.stdout, re.DOTALL)[1])
    plane, bore, one, both, nothing, named, drawn = json.loads(title)
    assert plane == '--interface "NAME=plane z=5mm"'
    assert bore == '--interface "NAME=cylinder r=6mm at 45,25,0mm"'
    assert re.fullmatch(r'--interface "NAME=surface_(19|20|21|22)"', one)
    assert re.fullmatch(r'--interface "NAME=plane z=5mm \+ surface_(19|20|21|22)"', both)
    assert nothing == "click a face"
    assert named == '--interface "pin=plane x=-60mm"'
    assert drawn == "drawn"
