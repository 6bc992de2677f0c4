"""Formats of other tools: each file here declares one, as `FORMAT`."""
