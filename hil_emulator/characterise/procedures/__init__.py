"""The bench tests: each file here is one, as `TEST`."""
