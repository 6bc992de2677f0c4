"""The machine this runs on: where files are, how memory is returned, other machines that help."""
