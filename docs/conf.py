"""Settings of Sphinx: the pages of this folder, pages from the declarations, and the API."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from hil_emulator import __version__

project = "hil-emulator"
version = release = __version__
copyright = "the maintainers of hil-emulator, Apache License 2.0"

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "build_time.execute",
    "build_time.from_declarations",
]
myst_enable_extensions = ["colon_fence", "dollarmath"]
myst_heading_anchors = 3
exclude_patterns = ["_build", "build_time"]
autodoc_typehints = "none"
html_theme = "alabaster"
html_theme_options = {
    "description": "An emulated hydraulic actuator on a real CAN bus",
    "page_width": "1100px",
}
html_sidebars = {"**": ["about.html", "navigation.html", "searchbox.html"]}
