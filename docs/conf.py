"""The documentation site: `make docs` builds it into build/docs, without a network.

Sources are the project's own Markdown pages, where they are: links between them work here and in a repository browser
alike. What a section page lists as `- [title](page.md)` is its table of contents.
"""

from __future__ import annotations

import os
import re
import shutil
import sys
from pathlib import Path
from typing import Any

from docutils import nodes
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx
from sphinx_gallery.scrapers import figure_rst

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

project, author, copyright = "seatfem", "the seatfem authors", "GPL-2.0-or-later"
root_doc = "docs/index"
include_patterns = ["README.md", "CONTRIBUTING.md", "CHANGELOG.md", "docs/**.md"]
include_patterns += ["docs/gallery/*.rst", "docs/generated/*.rst"]  # made by the build
exclude_patterns = [".*", "build", "dist", "tests", "impact", "seatfem", "docs/gallery/sg_execution_times.rst"]
extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "sphinx_gallery.gen_gallery",
]
html_theme = "pydata_sphinx_theme"
html_title = "seatfem"
html_show_sourcelink = False
html_theme_options = {"navbar_align": "left", "show_prev_next": False, "footer_start": [], "footer_end": []}
templates_path = [str(ROOT / "docs" / "templates")]
html_static_path = ["site.css"]
html_css_files = ["site.css"]
html_math_renderer = "mathml"
suppress_warnings = ["config.cache"]  # the configuration of the gallery holds a function

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4
autodoc_member_order = "bysource"
autodoc_typehints = "none"  # docstrings state units and shapes, which types do not
napoleon_use_ivar = True  # the docstring of a class describes its attributes
napoleon_attr_annotations = False


def written_pictures(_: Any, block_vars: dict[str, Any], gallery_conf: dict[str, Any]) -> str:
    """Scraper of the gallery: the PNG files that an example wrote, of matplotlib and of pyvista alike."""
    paths = block_vars["image_path_iterator"]
    shown = []
    for written in sorted(Path(block_vars["src_file"]).parent.glob("*.png")):
        shown.append(next(paths))
        shutil.move(written, shown[-1])
    return figure_rst(shown, gallery_conf["src_dir"])


sphinx_gallery_conf = {
    "examples_dirs": str(ROOT / "examples"),
    "gallery_dirs": str(ROOT / "docs" / "gallery"),
    "filename_pattern": r"/(?!bar_as_rod)\w+\.py$",  # takes 13 s of processor time: shown, not run
    "ignore_pattern": r"readme\.py$",  # shown by README.md
    "remove_config_comments": True,
    "image_scrapers": (written_pictures,),
    "abort_on_example_error": True,
    "download_all_examples": False,
    "show_signature": False,
    "min_reported_time": 1e9,
    "write_computation_times": False,
}


FOLDED = r"""\g<0>

<details><summary>The file</summary>

```{literalinclude} \1
:language: toml
```

</details>"""
"""After the command of a scene, in the built page: what its file says."""
SECTIONS = (root_doc, "docs/users", "docs/trust", "docs/maintainers", "docs/scene")


def contents(app: Sphinx, docname: str, source: list[str]) -> None:
    """Add what only the built pages have: the list of a section page as a hidden toctree, the files of the gallery."""
    if docname == "docs/scenes":
        source[0] = re.sub(r"^\[`seatfem .*\]\((.*\.toml)\)$", FOLDED, source[0], flags=re.MULTILINE)
        source[0] = re.sub(r"\(\.\./examples/(\w+)\.py\)", r"(gallery/\1.rst)", source[0])
    if docname not in SECTIONS:
        return
    for caption, listed in _listed(ROOT / f"{docname}.md"):
        if caption.endswith("Python"):
            listed.append("Python examples </docs/gallery/index>")  # no page before it is built
        entries = "\n".join(listed)
        source[0] += f"\n\n```{{toctree}}\n:hidden:\n:caption: {caption}\n\n{entries}\n```\n"


def _listed(page: Path) -> list[tuple[str, list[str]]]:
    """Return the headings of a page under which pages are listed, each with the entries of its table of contents."""
    sections = re.split(r"^##? ", page.read_text(encoding="utf-8"), flags=re.MULTILINE)[1:]
    lists = []
    for section in sections:
        links = re.findall(r"^- \[([^\]]+)\]\(([\w./]+)\.(?:md|rst)\)", section, re.MULTILINE)
        entries = [f"{title} </{os.path.relpath(page.parent / link, ROOT)}>" for title, link in links]
        if entries:
            lists.append((section.partition("\n")[0], entries))
    return lists


def as_restructured(app: Sphinx, what: str, name: str, obj: object, options: object, lines: list[str]) -> None:
    """Docstrings are plain text: formulas indented after a colon are literal, bars and stars stand for themselves."""
    text = re.sub(r"(?<!:):\n\n(?= {4}\S)", "::\n\n", "\n".join(lines))
    spans = re.split(r"(``.+?``|`[^`\n]+`)", text)
    spans[::2] = [re.sub(r"(?<!\\)([|*])", r"\\\1", part) for part in spans[::2]]
    lines[:] = "".join(spans).split("\n")


def math(translator: Any, node: nodes.math | nodes.math_block) -> None:
    """MathML, which browsers draw by themselves: no script, no fonts, no TeX."""
    translator.body.append(tex2mathml(node.astext(), as_block=isinstance(node, nodes.math_block)))
    raise nodes.SkipNode


def front_door(app: Sphinx, failure: Exception | None) -> None:
    """The folder opens at the first page."""
    if failure is None and app.builder.format == "html":
        (Path(app.outdir) / "index.html").write_text('<meta http-equiv="refresh" content="0; url=docs/index.html">\n')


def setup(app: Sphinx) -> None:
    app.connect("source-read", contents)
    app.connect("autodoc-process-docstring", as_restructured, priority=900)
    app.connect("build-finished", front_door)
    app.add_html_math_renderer("mathml", inline_renderers=(math, None), block_renderers=(math, None))
