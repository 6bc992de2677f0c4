"""Functional mock-up units: other plants in here, ours elsewhere (https://fmi-standard.org)."""
