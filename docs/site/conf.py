"""Settings of the site: all pages of the repository, the gallery, and the reference of `fingerpad`.

The source folder is the root of the repository, so that pages keep their links to each other and to files.
"""

import re
import sys
from pathlib import Path

import latex2mathml.converter
from docutils import nodes

import fingerpad

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))

from reference import write_reference  # noqa: E402 - lies beside this file

project = "fingerpad"
author = "the authors of fingerpad"
project_copyright = f"%Y, {author}"
version = release = fingerpad.__version__
root_doc = "docs/index"
include_patterns = ["docs/**", "README.md", "CHANGELOG.md", "CONTRIBUTING.md", "benchmarks/README.md"]
exclude_patterns = [".venv", ".peers", "build", "**/__pycache__", "docs/gallery", "docs/site"]

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "sphinx_gallery.gen_gallery",
]
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
myst_enable_extensions = ["dollarmath", "attrs_inline"]
myst_heading_anchors = 4
myst_url_schemes = dict.fromkeys(("http", "https", "mailto")) | {"doi": "https://doi.org/{{path}}"}
# Pages of decisions are linked from docs/decisions.md. Shapes such as (n_sites,) are no references.
suppress_warnings = ["config.cache", "toc.not_included", "ref.python"]

default_role = "code"
autodoc_typehints = "none"  # docstrings give units and shapes, which types do not
autodoc_default_options = {"members": True, "member-order": "bysource"}
autosummary_generate = False
napoleon_use_rtype = False
napoleon_use_ivar = True

sphinx_gallery_conf = {
    "examples_dirs": "docs/gallery",
    "gallery_dirs": "docs/examples",
    "filename_pattern": r"\.py$",
    "abort_on_example_error": True,
    "within_subsection_order": "FileNameSortKey",
    "download_all_examples": False,
    "write_computation_times": False,
    "remove_config_comments": True,
    "capture_repr": (),
    "min_reported_time": 3600,
}

html_math_renderer = "mathml"
html_theme = "furo"
html_title = "fingerpad"
html_extra_path = ["root"]  # the address of the site leads to its first page
html_copy_source = False
html_show_sourcelink = False


def mathml(translator, node) -> None:  # type: ignore[no-untyped-def]
    """Write a formula as MathML, which browsers show without a script from another server."""
    display = "block" if isinstance(node, nodes.math_block) else "inline"
    translator.body.append(latex2mathml.converter.convert(node.astext(), display=display))
    raise nodes.SkipNode


def anchors(app, name, source) -> None:  # type: ignore[no-untyped-def]
    """Turn anchors in HTML, which GitHub reads, into targets that Sphinx knows."""
    source[0] = re.sub(r'<a id="([^"]+)"></a>(\[[^\]]+\]\([^)]+\)|[^|]+?)(?= \|)', r"[\2]{#\1}", source[0])


def of_field(what: str) -> bool:
    return what in ("attribute", "data", "property")


def keep_field(app, what, name, value, options, lines) -> None:  # type: ignore[no-untyped-def]
    """Keep the explanation of a field from Napoleon, which takes what stands before a colon for a type."""
    if of_field(what):
        app.explanations[name] = lines[:]


def restore_field(app, what, name, value, options, lines) -> None:  # type: ignore[no-untyped-def]
    if of_field(what):
        lines[:] = app.explanations[name]


def setup(app) -> None:  # type: ignore[no-untyped-def]
    """Write the pages of the reference, which follow the list of public names."""
    app.connect("source-read", anchors)
    app.explanations = {}
    app.connect("autodoc-process-docstring", keep_field, priority=400)
    app.connect("autodoc-process-docstring", restore_field, priority=600)  # Napoleon's is 500
    app.add_html_math_renderer("mathml", (mathml, None), (mathml, None))
    write_reference(HERE.parent / "reference")
