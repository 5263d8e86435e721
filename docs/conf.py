"""The site: ``pip install -e ".[docs]"``, then ``sphinx-build -W docs outputs/site``.

It is built without a network, and its pages load nothing from elsewhere.
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "extensions"))

project = "ForestRL"
extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
    "mathml",
    "outside",
    "settings_page",
]
exclude_patterns = ["extensions"]

html_static_path, html_css_files = ["static"], ["formulas.css"]
html_theme = "furo"
html_title = "ForestRL"
html_show_copyright = html_show_sphinx = html_copy_source = False
html_theme_options = {
    "light_css_variables": {"color-brand-primary": "#2e7d32", "color-brand-content": "#2e7d32"},
    "dark_css_variables": {"color-brand-primary": "#81c784", "color-brand-content": "#81c784"},
}

myst_enable_extensions = ["colon_fence", "dollarmath", "html_image"]
myst_heading_anchors = 3

autodoc_default_options = {"members": True, "show-inheritance": True}
autodoc_inherit_docstrings = False
autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
napoleon_numpy_docstring = False
