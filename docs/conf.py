"""The documents site: `nox -s docs` makes it. Pages are plain Markdown, so they can be read on their own, too."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.application import Sphinx
from sphinx.writers.html5 import HTML5Translator
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
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
html_math_renderer = "mathml"  # browsers show it without a script from elsewhere
exclude_patterns = ["_build", "made/*/**"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
autodoc_typehints = "signature"
napoleon_use_ivar = True  # attributes once, where members are listed as well
autodoc_type_aliases = {"Array": "Array", "ArrayLike": "ArrayLike"}
html_theme = "furo"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_title = f"vgtsim {release}"
html_show_sourcelink = False
html_copy_source = False

(HERE / "made").mkdir(exist_ok=True)
verbs = get_command(program)
page = get_docs_for_click(obj=verbs, ctx=Context(verbs, info_name="vgtsim"), name="vgtsim", title="Every verb")
(HERE / "made/verbs.md").write_text(page, encoding="utf-8")


def write_formula(writer: HTML5Translator, node: nodes.math) -> None:
    """Write a formula within a line."""
    writer.body.append(convert(node.astext()))
    raise nodes.SkipNode


def write_equation(writer: HTML5Translator, node: nodes.math_block) -> None:
    """Write a formula that stands alone."""
    writer.body.append(f'<div class="equation">{convert(node.astext(), display="block")}</div>')
    raise nodes.SkipNode


def name_aliases(_app: Sphinx, _what: str, _name: str, _obj: object, _options: object, *signature: str | None) -> Any:
    """Name the aliases of a signature: in unions Sphinx shows what stands for them while it reads."""
    return tuple(text and re.sub(r"TypeAliasForwardRef\('(\w+)'\)", r"\1", text) for text in signature)


def setup(app: Sphinx) -> None:
    """Add formulas as MathML, and the names of aliases."""
    app.connect("autodoc-process-signature", name_aliases)
    app.add_html_math_renderer("mathml", (write_formula, None), (write_equation, None))
