"""Scenarios: actions on a rig, and expectations of it, in a TOML file."""
