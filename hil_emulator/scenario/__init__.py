"""Scenarios: what happens to a rig, and what is expected of it, in a TOML file."""
