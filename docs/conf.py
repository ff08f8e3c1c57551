"""The documents site: `nox -s docs` makes it. Pages are plain Markdown, so they can be read on their own, too."""

from __future__ import annotations

import sys
from pathlib import Path

from typer import Context
from typer.cli import get_docs_for_click
from typer.main import get_command

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent))

import vgtsim  # noqa: E402  this checkout's
from vgtsim.cli import app as program  # noqa: E402

project = "vgtsim"
author = copyright = "The vgtsim developers"
release = vgtsim.__version__
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.mathjax"]
exclude_patterns = ["_build", "made/*/**"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
autodoc_typehints = "signature"
autodoc_type_aliases = {"Array": "Array", "ArrayLike": "ArrayLike"}
html_theme = "furo"
html_title = f"vgtsim {release}"
html_show_sourcelink = False
html_copy_source = False

(HERE / "made").mkdir(exist_ok=True)
verbs = get_command(program)
page = get_docs_for_click(obj=verbs, ctx=Context(verbs, info_name="vgtsim"), name="vgtsim", title="Every verb")
(HERE / "made/verbs.md").write_text(page, encoding="utf-8")
