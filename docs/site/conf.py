"""Settings of Sphinx for the site. Nothing is fetched, neither when it is built nor when it is read."""

from typing import Any

from sphinx.application import Sphinx

project = "Tauscope"
html_title = "Tauscope"
copyright = "The Tauscope developers"

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
myst_heading_anchors = 4  # links to headings as GitHub makes them
napoleon_google_docstring = False
autodoc_member_order = "bysource"
autodoc_preserve_defaults = True
python_maximum_signature_line_length = 88  # else one parameter a line
python_use_unqualified_type_names = True
python_display_short_literal_types = True

html_theme = "furo"
html_copy_source = False
html_show_sphinx = False


def _collapse(_app: Sphinx, _page: str, _template: str, context: dict[str, Any], _tree: object) -> None:
    """Let the sidebar open the present section only: the time that a build takes no longer grows with pages squared."""
    toctree = context["toctree"]
    context["toctree"] = lambda **options: toctree(**{**options, "collapse": True})


def setup(app: Sphinx) -> None:
    """Register what the theme has no setting for."""
    app.connect("html-page-context", _collapse, priority=100)  # before the theme makes its sidebar
