"""Disagreement of model and measurement by channel, balance and region."""
