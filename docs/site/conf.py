"""How Sphinx makes the site from the pages; ``python -m tools.site`` lays them out and starts it."""

from __future__ import annotations

from pathlib import Path

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.addnodes import pending_xref
from sphinx.application import Sphinx
from sphinx.writers.html5 import HTML5Translator

import swesbi

project = "swesbi"
version = release = swesbi.__version__
author = "the authors of swesbi"
root_doc = "README"
include_patterns = ["**.md"]
exclude_patterns = ["CHANGELOG.md"]  # history names pages that are gone
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
myst_enable_extensions = ["deflist", "dollarmath", "html_image"]
myst_fence_as_directive = ["math"]
myst_heading_anchors = 4
autodoc_member_order = "bysource"
autodoc_typehints = "none"
napoleon_attr_annotations = False
html_theme = "furo"
html_title = "swesbi"
html_copy_source = False
html_show_copyright = False
html_show_search_summary = False  # it would be fetched, which a browser refuses for files
html_math_renderer = "mathml"


def inline_math(writer: HTML5Translator, node: nodes.math) -> None:
    """Write a formula in a line as MathML, which browsers show without further programs."""
    writer.body.append(convert(node.astext()))
    raise nodes.SkipNode


def block_math(writer: HTML5Translator, node: nodes.math_block) -> None:
    """Write a formula of its own as MathML."""
    formula = convert(node.astext(), display="block")
    writer.body.append(f'<div style="overflow-x: auto; padding: 0.5em 0">{formula}</div>\n')
    raise nodes.SkipNode


def unlink_unpaged(app: Sphinx, page: nodes.document) -> None:
    """Show a link to a folder, or to what is left out, as text: a site has no page for it."""
    here = Path(app.srcdir, app.env.docname).parent
    for link in [link for link in page.findall(pending_xref) if link["reftype"] == "myst"]:
        left_out = link["refdomain"] == "doc" and link["reftarget"] not in app.env.found_docs
        if left_out or (here / link["reftarget"]).is_dir():
            link.replace_self(link.children)


def setup(app: Sphinx) -> None:
    """Offer MathML to Sphinx, and drop links without a page."""
    app.connect("doctree-read", unlink_unpaged)
    app.add_html_math_renderer("mathml", (inline_math, None), (block_math, None))
