"""HTML pages of results: templates, their one stylesheet, and the way to fill them in."""
