"""Functional mock-up units: import of other plants, export of this one (fmi-standard.org)."""
