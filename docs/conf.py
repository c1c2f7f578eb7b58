"""The documentation's configuration: ``sphinx-build -W -c docs . build/docs`` (see ``docs/build``)."""

import os
import sys
from pathlib import Path

import nacre

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "docs" / "extensions"))

project = "nacre"
author = "The nacre authors"
copyright = "the nacre authors"
release = version = nacre.__version__

root_doc = "docs/index"
include_patterns = [
    "docs/**.md",
    "README.md",
    "CHANGELOG.md",
    "CONTRIBUTING.md",
    "SECURITY.md",
    "benchmarks/README.md",
    "third_party/README.md",
]
exclude_patterns = ["build", ".venv", "**/results/**"]
extensions = ["myst_parser", "sphinx.ext.autodoc", "numpydoc", "breathe", "decisions", "mathml", "parameters"]
html_math_renderer = "mathml"
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3

autodoc_default_options = {"members": True, "show-inheritance": False}
autodoc_typehints = "none"  # the docstrings say more: shapes and units
autodoc_member_order = "bysource"
numpydoc_show_class_members = False

breathe_projects = {"nacre": os.environ.get("NACRE_DOXYGEN", str(ROOT / "build" / "doxygen" / "xml"))}
breathe_default_project = "nacre"

html_theme = "furo"
html_title = "nacre"
html_static_path = []
