"""The site: pages of this folder, gallery of examples/gallery, reference from the code; `python3 bootstrap.py site`.

Every example is executed; a warning, an example that fails and a link that leads nowhere fail the build. The pages load
nothing from elsewhere: search, formulas and viewers work without a network.
"""

import os
import shutil
import sys
from importlib.metadata import version as version_of
from pathlib import Path

DOCS = Path(__file__).resolve().parent
ROOT = DOCS.parent
sys.path[:0] = [str(DOCS / "extensions"), str(ROOT)]
os.environ.setdefault("OMP_NUM_THREADS", "1")  # examples run side by side

project = "ffr"
author = "the authors of ffr"
copyright = "the authors of ffr"
version = release = version_of("ffr")

extensions = [
    "myst_parser",
    "sphinx_copybutton",
    "sphinx_design",
    "sphinx_gallery.gen_gallery",
    "made",
    "mathml",
    "offline",
    "repository",
]
exclude_patterns = ["extensions", "gallery/**/*.ipynb", "gallery/**/*.py"]
nitpicky = False  # types in signatures are words of annotations, few of which have pages

html_theme = "furo"
html_title = f"ffr {version}"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_show_sphinx = False
html_theme_options = {"navigation_with_keys": True}

myst_enable_extensions = ["colon_fence", "deflist", "dollarmath", "fieldlist"]
myst_heading_anchors = 4
suppress_warnings = ["toc.empty_glob", "config.cache"]
copybutton_prompt_text = r">>> |\.\.\. |\$ "
copybutton_prompt_is_regexp = True


linkcheck_timeout = 20
linkcheck_retries = 2

# ---- gallery --------------------------------------------------------------------------------------------------------

TITLES = ("mechanisms", "beams_and_plates", "vibration", "bodies_and_files", "studies_and_accuracy")


def _examples() -> str:
    """A copy of examples/gallery whose folders hold the meshes, as the checkout does; what examples write stays there."""
    copy = ROOT / "build" / "gallery"
    shutil.rmtree(copy, ignore_errors=True)
    shutil.copytree(
        ROOT / "examples" / "gallery", copy, ignore=shutil.ignore_patterns("__pycache__", "out", "README.md")
    )
    for folder in TITLES:
        (copy / folder / "meshes").symlink_to(ROOT / "meshes")
    return str(copy)


sphinx_gallery_conf = {
    "examples_dirs": _examples(),
    "gallery_dirs": "gallery",
    "filename_pattern": r"/plot_",
    "subsection_order": [f"../build/gallery/{folder}" for folder in TITLES],
    "within_subsection_order": "FileNameSortKey",
    "parallel": int(os.environ.get("FFR_SITE_PROCESSES", "2")),
    "capture_repr": ("_repr_html_",),
    "image_scrapers": ("films.pictures",),
    "reset_modules": ("matplotlib",),
    "abort_on_example_error": False,
    "only_warn_on_example_error": False,
    "backreferences_dir": "gallery/backreferences",
    "doc_module": ("ffr_dyn", "ffr_prep"),
    "download_all_examples": False,
    "remove_config_comments": True,
    "show_memory": False,
    "min_reported_time": 0,
    "copyfile_regex": "",
    "show_signature": False,
    "write_computation_times": False,  # a table that loads its script from elsewhere
    "nested_sections": True,
}
